#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <ranges>
#include <set>
#include <utility>
#include <vector>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/io/trajectory.h"
#include "slam/map/map.h"
#include "slam/mapping/mapping_options.h"
#include "slam/mapping/upright.h"
#include "slam/objects/object_mapper.h"
#include "slam/snapshot/snapshot.h"
#include "slam/tracking/tracking_report.h"
#include "slam/util/to_vector.h"

namespace sqslam {

class ByteReader;
class ByteWriter;
struct IdShift;

// Keeps at most `max_frames` frames by their `index`, thinned out evenly.
template <typename Frame>
class ThinnedFrames {
 public:
  explicit ThinnedFrames(int max_frames) : max_frames_(max_frames) {}

  void Add(Frame frame) {
    if (offered_++ % every_ != 0 || max_frames_ == 0) {
      return;
    }
    if (static_cast<int>(frames_.size()) >= max_frames_) {
      every_ *= 2;
      bool odd = false;
      std::erase_if(frames_, [&](const auto&) { return std::exchange(odd, !odd); });
    }
    const std::int64_t index = frame.index;
    frames_.insert_or_assign(index, std::move(frame));
  }
  void Remove(std::int64_t index) { frames_.erase(index); }
  Frame* Find(std::int64_t index) {  // null if it is not there
    const auto frame = frames_.find(index);
    return frame != frames_.end() ? &frame->second : nullptr;
  }

  const std::map<std::int64_t, Frame>& ByIndex() const { return frames_; }
  std::vector<std::int64_t> Indices() const { return ToVector(frames_ | std::views::keys); }

 private:
  int max_frames_;
  std::int64_t every_ = 1;    // one frame in this many is kept
  std::int64_t offered_ = 0;  // number of Add() calls
  std::map<std::int64_t, Frame> frames_;
};

// A frame and its place in the map.
struct FrameRecord {
  double timestamp = 0.0;  // seconds
  AnchoredPose pose;

  static void VisitState(auto& self, auto&& visit) { visit(self.timestamp, self.pose); }
};

// One connected map with its frames and objects. Its frame starts as that of its first camera.
class Submap {
 public:
  Submap(std::int64_t number, std::unique_ptr<Map> map, const MapperOptions& options);

  // Reads a saved submap into an empty map. Throws InputError if it is invalid.
  Submap(ByteReader& reader, std::unique_ptr<sqslam::Map> map, const Camera& camera,
         const MapperOptions& options);

  // Serializes the submap at the end of a run, without the matches of its frames.
  void Save(ByteWriter& writer) const;

  // Shifts all ids, frame indices and times.
  void Renumber(const IdShift& shift);

  std::int64_t Number() const { return number_; }
  sqslam::Map& Map() { return *map_; }
  const sqslam::Map& Map() const { return *map_; }
  std::set<PointId>& YoungPoints() { return young_points_; }
  ObjectMapper& Objects() { return objects_; }
  const ObjectMapper& Objects() const { return objects_; }

  // Records a frame relative to its reference keyframe.
  void RecordFrame(std::int64_t index, double timestamp, const AnchoredPose& pose,
                   std::vector<FrameMatch> matches = {});

  // Refines the poses of non-keyframes in the present map, except the `keep` newest frames, and drops their
  // matches: from then on they follow their keyframes.
  void RefineFrames(const Camera& camera, int min_inliers, int keep = 0);

  // Returns at most `most` non-keyframes, evenly spread, with their matches: for the final bundle adjustment.
  std::vector<BundleFrame> FramesBetween(int most) const;

  // All tracked frames by index; never empty.
  const std::map<std::int64_t, FrameRecord>& Frames() const { return frames_; }
  std::optional<Rigid3d> FramePose(std::int64_t index) const;  // T_map_camera

  // Returns the map points seen in a frame, until RefineFrames() drops their matches.
  std::vector<TrackedPoint> PointsIn(std::int64_t index, const Camera& camera) const;

  // Turns the map upright if a better estimate of gravity exists. Returns the change of the map frame.
  std::optional<Rigid3d> KeepUpright(const Camera& camera, bool last);

  // Updates the objects observed since the last call, a few at a time; `moved_everywhere` queues all of them.
  // MapObjectsLast updates all of them, from all initial guesses.
  void MapObjects(const Camera& camera, bool moved_everywhere);
  void MapObjectsLast(const Camera& camera);

  // Objects that are reliable enough for bundle adjustment, and the results that it returns by object id.
  std::vector<ObjectTerm> ObjectTerms(const JointObjectOptions& options) const;
  void CorrectObjects(const std::vector<std::pair<int, PosedSuperquadric>>& corrections,
                      const Camera& camera);

  // Moves map and objects: p_new = S_new_old * p_old.
  void Transform(const Sim3d& S_new_old);

  // Lets `change` deform the map (loop closure, full adjustment), and moves each object with the keyframes
  // that observed it.
  void Deform(const std::function<void(sqslam::Map&)>& change);

  // Takes over the content of another submap, which must be in this one's frame already.
  void Absorb(Submap&& other);

  TrackingViewPtr MakeView() const;
  void FillSnapshot(MapSnapshot& snapshot) const;  // keyframes, their covisibility, points, objects, upright
  Trajectory FrameTrajectory() const;
  Trajectory KeyframeTrajectory() const;

 private:
  struct FrameMatches {
    std::int64_t index = 0;
    std::vector<FrameMatch> matches;
  };
  bool IsKeyframe(std::int64_t index, const FrameRecord& record) const;
  Rigid3d PoseOf(const FrameRecord& record) const;  // T_map_camera
  PointLookup LookupPoints() const;
  PoseLookup LookupPoses() const;

  std::int64_t number_;
  std::unique_ptr<sqslam::Map> map_;
  std::set<PointId> young_points_;  // not yet proven, see CullPoints()
  std::map<std::int64_t, FrameRecord> frames_;
  std::map<std::int64_t, std::vector<FrameMatch>> unrefined_;  // matches of frames to be refined, by index
  ThinnedFrames<FrameMatches> between_;                        // matches of refined frames
  UprightEstimator upright_;
  ObjectMapper objects_;
};

}  // namespace sqslam
