#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "slam/map/anchored_pose.h"
#include "slam/tracking/pose_tracker.h"

namespace sqslam {

class ByteReader;
class ByteWriter;

// A frame and its place in the map.
struct FrameRecord {
  double timestamp = 0.0;  // seconds
  AnchoredPose pose;

  static void VisitState(auto& self, auto&& visit) { visit(self.timestamp, self.pose); }
};

// A frame that may still be refined.
struct OpenFrame : FrameRecord {
  std::vector<FrameMatch> matches;  // that give the pose
};

// The frames of a submap by index. Settled frames are not refined any more and need no matches: a live camera
// brings a hundred thousand an hour, which take 16 MB.
class FrameRecords {
 public:
  void Record(std::int64_t index, OpenFrame frame);

  // Settles open frames below an index, without their matches.
  void SettleBelow(std::int64_t index);
  std::map<std::int64_t, OpenFrame>& Open() { return open_; }
  const std::map<std::int64_t, OpenFrame>& Open() const { return open_; }

  int Size() const { return static_cast<int>(settled_.size() + open_.size()); }
  std::optional<FrameRecord> Find(std::int64_t index) const;
  bool Contains(std::int64_t index) const { return Find(index).has_value(); }
  std::pair<std::int64_t, FrameRecord> Oldest() const;
  std::pair<std::int64_t, FrameRecord> Newest() const;
  std::pair<std::int64_t, FrameRecord> FromOn(
      std::int64_t index) const;  // the first from there on, or the last
  void ForEach(const std::function<void(std::int64_t index, const FrameRecord&)>& visit) const;  // by index

  // Takes over the frames of another one, except for those of the same index.
  void Absorb(FrameRecords&& other);
  void Renumber(std::int64_t index_shift, double time_shift, KeyframeId keyframe_shift);

  void Save(ByteWriter& writer) const;
  void Load(ByteReader& reader);  // all settled

 private:
  std::map<std::int64_t, FrameRecord> settled_;
  std::map<std::int64_t, OpenFrame> open_;
};

}  // namespace sqslam
