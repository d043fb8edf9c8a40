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

// Histories of a run and its objects, from its snapshots in their order: of a recording in one pass, of a
// live run by each new one.
namespace sqslam::viewer {

// One value of a run against its frames. Values that a snapshot does not know (older recordings,
// deterministic runs, which are not timed) are missing: the line has a gap there.
struct Series {
  std::string name;
  std::string unit;  // empty: a count
  std::vector<double> frame;
  std::vector<double> time;  // seconds of the sequence
  std::vector<std::optional<double>> value;

  bool HasValues() const;
  std::pair<double, double> Range() const;             // least and largest value; 0, 0 where there is none
  std::optional<double> At(double frame_index) const;  // of the newest snapshot until then
};

// Frames between two snapshots in which something happened.
struct RunMark {
  enum class Kind { kKeyframe, kLoop, kMerge, kLost, kFoundAgain };
  Kind kind = Kind::kKeyframe;
  std::int64_t frame_index = 0;
  double timestamp = 0.0;  // seconds
};
constexpr auto EnumNames(RunMark::Kind) {
  return std::array{"keyframe", "loop closed", "maps merged", "tracking lost", "tracking found again"};
}

// Series with one value a snapshot, about one a keyframe, and marks.
class RunSeries {
 public:
  RunSeries();

  void Add(const MapSnapshot& map);

  // "tracked points", "tracking" and "mapping" (ms), "objects", "keyframes", "map points", "boxes with an
  // object". Throws std::out_of_range for another name.
  const Series& Named(std::string_view name) const;

  // In the order of frames. Keyframes are those of the newest map, as long as they were not culled.
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
  int observations = 0;  // until then
  // Radians, without jumps: a solid turned by a quarter with its x and y axes swapped is the same, and of
  // these descriptions samples have the one nearest to the sample after; the newest has the map's own.
  double yaw = 0.0;
  Eigen::Vector3d half_size = Eigen::Vector3d::Zero();  // map units of that snapshot, axes as yaw has them
  double e1 = 0.0;
  double e2 = 0.0;
};

// Samples of all objects by id, also of those that are gone at the end.
using ObjectHistories = std::map<int, std::vector<ObjectSample>>;

// Adds a map, `snapshot` its index in the recording; the maps must come in order.
void AddSamples(int snapshot, const MapSnapshot& map, ObjectHistories& histories);

}  // namespace sqslam::viewer
