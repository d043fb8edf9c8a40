#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "slam/objects/object_options.h"
#include "slam/objects/object_types.h"
#include "slam/objects/support.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

class ByteReader;
class ByteWriter;

// The objects' share of the mapping thread: owns the landmarks, removes outliers, estimates the superquadrics
// and merges landmarks that are the same object. No threads inside; deterministic for a seed.
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

  // Tells that the map's z axis points up, and the surfaces that things may stand on. Until then no yaw is
  // estimated.
  void SetUpright(bool upright, SupportSurfaces supports);

  // Re-estimates the landmarks with the largest share of new boxes, at most options.max_estimates; merges,
  // and re-estimates as many of those that were merged; deletes. `poses`, where given, renews the camera
  // poses of past observations first.
  void Update(const PointLookup& points, const Camera& camera, const PoseLookup& poses = {});

  // Puts every landmark in the queue for Update(), to be estimated from scratch: the map has changed
  // everywhere.
  void Outdate();

  // Re-estimates every landmark, from all starts (end of the run).
  void UpdateAll(const PointLookup& points, const Camera& camera, const PoseLookup& poses = {});

  // Takes over a superquadric that was estimated elsewhere, unless the boxes of the landmark speak against it
  // or the landmark is gone. It stays until the landmark is estimated again. Returns whether it was taken.
  bool Correct(int id, const PosedSuperquadric& superquadric, const Camera& camera);

  // The map frame was changed: p_new = S_new_old * p_old.
  void Transform(const Sim3d& S_new_old);

  // The map was bent: each landmark goes along with the frames that saw it.
  void MoveWith(const MotionLookup& S_new_old);

  // Takes over the landmarks of another submap, which must be in this map's frame already. Those that are the
  // same object are merged at the next update.
  void Absorb(ObjectMapper&& other);

  // Those good enough to show, by id, in the chosen representation. Objects that it can't represent (boxes
  // that determine no quadric) are left out, and counted by LeftOut().
  std::vector<SnapshotObject> Objects() const;
  int LeftOut() const;
  std::shared_ptr<const ObjectMapView> View() const;
  std::unordered_map<std::int64_t, int> PointObjects() const;  // map point id -> id of a shown object
  // Raises the ids of landmarks and of map points, and the indices of frames.
  void Renumber(int id_shift, std::int64_t point_shift, std::int64_t frame_shift);

  // Writes the landmarks with all that they are estimated from, and takes them over into a mapper without
  // any. Load throws InputError.
  void Save(ByteWriter& writer) const;
  void Load(ByteReader& reader);

  // By map point id; points that were never in the box of a shown object are left out.
  std::unordered_map<std::int64_t, PointEvidence> Evidence() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
