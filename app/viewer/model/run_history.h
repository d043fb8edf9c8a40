#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "slam/snapshot/snapshot.h"

// Histories of a run and its objects, built from its snapshots in order: in one pass over a recording, or
// from each new snapshot of a live run.
namespace sqslam::viewer {

// One value of a run by frame. Values that a snapshot lacks (older recordings; deterministic runs, which are
// not timed) are empty and leave a gap in the line.
struct Series {
  std::string name;
  std::string unit;  // empty: a count
  std::vector<double> frame;
  std::vector<double> time;  // seconds of the sequence
  std::vector<std::optional<double>> value;

  bool HasValues() const;
  std::pair<double, double> Range() const;             // minimum and maximum; 0, 0 if there are none
  std::optional<double> At(double frame_index) const;  // of the last snapshot up to it
};

// An event between two snapshots.
struct RunMark {
  enum class Kind { kKeyframe, kLoop, kMerge, kLost, kFoundAgain };
  Kind kind = Kind::kKeyframe;
  std::int64_t frame_index = 0;
  double timestamp = 0.0;  // seconds
};
constexpr auto EnumNames(RunMark::Kind) {
  return std::array{"keyframe", "loop closed", "maps merged", "tracking lost", "tracking found again"};
}

// Series with one value per snapshot (about one per keyframe), and marks.
class RunSeries {
 public:
  RunSeries();

  void Add(const MapSnapshot& map);

  // Drops every second value of a series with more than `max_values`, but keeps the first and the last.
  void Thin(std::size_t max_values);

  // "tracked points", "tracking" (ms), "objects", "keyframes" or "map points". Throws std::out_of_range for
  // another name.
  const Series& Named(std::string_view name) const;

  // Returns the marks by frame, with the keyframes of the newest map: culled ones have no mark.
  std::vector<RunMark> Marks() const;

 private:
  std::vector<Series> series_;
  std::vector<RunMark> events_;     // all but keyframes
  std::vector<RunMark> keyframes_;  // of the newest map
  SnapshotProgress last_;
  bool tracked_ = true;
};

// An object at one snapshot.
struct ObjectSample {
  int snapshot = 0;  // its index in the recording
  std::int64_t frame_index = 0;
  int observations = 0;  // so far
  // Radians, unwrapped: a solid turned by a quarter with its x and y axes swapped is the same, and each
  // sample uses the description nearest to that of the next sample; the newest is as in the map.
  double yaw = 0.0;
  Eigen::Vector3d half_size = Eigen::Vector3d::Zero();  // map units of that snapshot, axes to match `yaw`
  double e1 = 0.0;
  double e2 = 0.0;
};

// Samples of all objects by id, including objects that were removed later.
using ObjectHistories = std::map<int, std::vector<ObjectSample>>;

// Adds a map with its index in the recording; maps must be added in order.
void AddSamples(int snapshot, const MapSnapshot& map, ObjectHistories& histories);

}  // namespace sqslam::viewer
