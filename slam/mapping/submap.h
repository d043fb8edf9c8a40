#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/io/trajectory.h"
#include "slam/map/map.h"
#include "slam/mapping/mapping_options.h"
#include "slam/mapping/thinned_frames.h"
#include "slam/mapping/upright.h"
#include "slam/objects/object_mapper.h"
#include "slam/snapshot/snapshot.h"
#include "slam/tracking/tracking_report.h"

namespace sqslam {

class ByteReader;
class ByteWriter;
struct IdShift;

// One connected map with all that belongs to it. Its frame begins as the first camera's.
class Submap {
 public:
  Submap(std::int64_t number, std::unique_ptr<Map> map, const MapperOptions& options);

  // Reads what Save wrote into an empty map. Throws InputError.
  Submap(ByteReader& reader, std::unique_ptr<sqslam::Map> map, const Camera& camera,
         const MapperOptions& options);

  // At the end of a run: by what points frames were found is forgotten.
  void Save(ByteWriter& writer) const;

  // Raises all ids, indices of frames and times.
  void Renumber(const IdShift& shift);

  std::int64_t Number() const { return number_; }
  sqslam::Map& Map() { return *map_; }
  const sqslam::Map& Map() const { return *map_; }
  std::set<PointId>& YoungPoints() { return young_points_; }
  ObjectMapper& Objects() { return objects_; }
  const ObjectMapper& Objects() const { return objects_; }

  // Frames by their anchors, see AnchoredPose.
  void RecordFrame(std::int64_t index, double timestamp, const AnchoredPose& pose,
                   std::vector<FrameMatch> matches = {});

  // Finds the frames between the keyframes again in the map as it is now, all but the `keep` newest, and
  // forgets by what they were found: from then on they follow their keyframes.
  void RefineFrames(const Camera& camera, int min_inliers, int keep = 0);

  // At most `most` of the frames between the keyframes, evenly spread, with what they saw of the points: for
  // the bundle adjustment at the end.
  std::vector<BundleFrame> FramesBetween(int most) const;

  bool HasFrame(std::int64_t index) const { return frames_.contains(index); }
  std::pair<std::int64_t, double> OldestFrameTime() const {
    return {frames_.begin()->first, frames_.begin()->second.timestamp};
  }
  std::int64_t NewestFrame() const { return frames_.rbegin()->first; }
  std::pair<std::int64_t, double> NewestFrameTime() const {
    return {frames_.rbegin()->first, frames_.rbegin()->second.timestamp};
  }
  int NumFrames() const { return static_cast<int>(frames_.size()); }
  std::optional<Rigid3d> FramePose(std::int64_t index) const;  // T_map_camera

  // Turns the map upright where that is known better now. Returns how the frame was moved.
  std::optional<Rigid3d> KeepUpright(bool last);

  // Estimates the objects that were seen since, a few at a time; `moved_everywhere` puts all of them in the
  // queue. The last time all of them, from all starts.
  void MapObjects(const Camera& camera, bool moved_everywhere);
  void MapObjectsLast(const Camera& camera);

  // The objects that are known well enough to take part in bundle adjustment, by id; and what it made of
  // them.
  std::vector<ObjectTerm> ObjectTerms(const JointObjectOptions& options) const;
  void CorrectObjects(const std::vector<std::pair<int, PosedSuperquadric>>& corrections,
                      const Camera& camera);

  // Moves everything: p_new = S_new_old * p_old.
  void Transform(const Sim3d& S_new_old);

  // Lets `change` bend the map (a loop, an adjustment of all of it), and carries each object along with the
  // keyframes that saw it.
  void Bend(const std::function<void(sqslam::Map&)>& change);

  // Takes over what another submap holds, which must be in this one's frame already.
  void Absorb(Submap&& other);

  TrackingViewPtr MakeView() const;
  void FillSnapshot(MapSnapshot& snapshot) const;  // keyframes, their covisibility, points, objects, upright
  Trajectory FrameTrajectory() const;
  Trajectory KeyframeTrajectory() const;

 private:
  struct FrameRecord {
    double timestamp = 0.0;
    AnchoredPose pose;
    std::vector<FrameMatch> matches;

    template <typename Self, typename Visit>
    static void VisitState(Self& self, Visit&& visit) {
      visit(self.timestamp, self.pose);
    }
  };
  struct FrameMatches {
    std::int64_t index = 0;
    std::vector<FrameMatch> matches;
  };
  Rigid3d PoseOf(const FrameRecord& record) const;  // T_map_camera
  PointLookup LookupPoints() const;
  PoseLookup LookupPoses() const;

  std::int64_t number_;
  std::unique_ptr<sqslam::Map> map_;
  std::set<PointId> young_points_;              // not yet proven, see CullPoints()
  std::map<std::int64_t, FrameRecord> frames_;  // by frame index
  std::int64_t refined_below_ = 0;              // frames below this index need not be refined again
  ThinnedFrames<FrameMatches> between_;         // of frames that were refined
  UprightEstimator upright_;
  ObjectMapper objects_;
};

}  // namespace sqslam
