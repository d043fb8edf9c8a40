#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "slam/objects/object_options.h"
#include "slam/objects/object_types.h"
#include "slam/objects/support.h"
#include "slam/objects/yaw.h"
#include "slam/snapshot/object_account.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

class ByteReader;
class ByteWriter;

// Object mapping in the mapping thread: owns the landmarks, removes outliers, estimates the superquadrics and
// merges duplicate landmarks. No threads inside; deterministic for a seed.
//
//   mapper.AddObservations(observations);   // of any number of frames, in order
//   mapper.Update(lookup, camera);          // after each keyframe
//   publish(mapper.View());                 // to the tracking thread
class ObjectMapper {
 public:
  ObjectMapper(const ObjectOptions& options, std::uint64_t seed);
  ~ObjectMapper();
  ObjectMapper(ObjectMapper&&) noexcept;
  ObjectMapper& operator=(ObjectMapper&&) noexcept;

  void AddObservations(std::span<const ObjectObservation> observations);

  // Sets whether the map's z axis points up, and the surfaces that objects may stand on. No yaw is estimated
  // before.
  void SetUpright(bool upright, SupportSurfaces supports);

  // Re-estimates the landmarks with the largest share of new boxes, at most options.max_estimates; merges,
  // and re-estimates as many of the merged ones; deletes. If given, `poses` first updates the camera poses of
  // past observations.
  void Update(const PointLookup& points, const Camera& camera, const PoseLookup& poses = {});

  // Queues every landmark for Update(), to be estimated from scratch after a change of the whole map.
  void Outdate();

  // Re-estimates every landmark, from all starts (end of the run).
  void UpdateAll(const PointLookup& points, const Camera& camera, const PoseLookup& poses = {});

  // Adopts a superquadric that was estimated elsewhere, until the landmark is estimated again, unless it fits
  // the boxes worse or the landmark is gone. Returns whether it was adopted.
  bool Correct(int id, const PosedSuperquadric& superquadric, const Camera& camera);

  // Applies a change of the map frame: p_new = S_new_old * p_old.
  void Transform(const Sim3d& S_new_old);

  // Applies a non-rigid map correction: each landmark moves with the frames that saw it.
  void MoveWith(const MotionLookup& S_new_old);

  // Adds the landmarks of another submap, which must be in this map's frame already. Duplicates are merged at
  // the next update.
  void Absorb(ObjectMapper&& other);

  // Returns the objects good enough to show, by id, in the chosen representation.
  std::vector<SnapshotObject> Objects() const;
  // Returns what became of the boxes of this run, and of every landmark, also of deleted ones; `boxes` and
  // `ignored` are left to the caller, who knows those that no frame of the map has.
  ObjectAccount Account() const;
  std::shared_ptr<const ObjectMapView> View() const;
  std::vector<std::vector<LineView>> Lines() const;            // of each landmark
  std::unordered_map<std::int64_t, int> PointObjects() const;  // map point id -> id of a shown object
  // Shifts the ids of landmarks and of map points, and the indices of frames.
  void Renumber(int id_shift, std::int64_t point_shift, std::int64_t frame_shift);

  // Writes the landmarks with all that they are estimated from, or reads them into an empty mapper. Load
  // throws InputError.
  void Save(ByteWriter& writer) const;
  void Load(ByteReader& reader);

  // By map point id; without points that were never in the box of a shown object.
  std::unordered_map<std::int64_t, PointEvidence> Evidence() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
