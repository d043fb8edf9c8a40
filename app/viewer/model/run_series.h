#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/viewer/model/snapshot_pass.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot.h"

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
std::string_view MarkName(RunMark::Kind kind);  // "loop closed", ...

// How a run went, from its snapshots: one value a snapshot (about one a keyframe) of each series. Grows
// snapshot by snapshot, as ObjectHistories does.
class RunSeries {
 public:
  RunSeries();

  void Add(const MapSnapshot& map);

  // Tracked points, time of tracking and mapping, objects, keyframes, map points, boxes with an object.
  const std::vector<Series>& All() const { return series_; }
  const Series& Named(std::string_view name) const;  // throws std::out_of_range

  // In the order of frames. Keyframes are those of the newest map, as long as they were not culled.
  std::vector<RunMark> Marks() const;

 private:
  void Push(std::size_t series, const MapSnapshot& map, std::optional<double> value);

  std::vector<Series> series_;
  std::vector<RunMark> events_;     // all but keyframes
  std::vector<RunMark> keyframes_;  // of the newest map
  SnapshotProgress last_;
  bool tracked_ = true;
};

// One pass over a recording; what had been read where it was stopped. Throws InputError on a broken one.
RunSeries ReadRunSeries(const RecordingReader& recording, const PassProgress& progress = {});

}  // namespace sqslam::viewer
