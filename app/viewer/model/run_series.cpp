#include "app/viewer/model/run_series.h"

#include <algorithm>
#include <stdexcept>

namespace sqslam::viewer {
namespace {

enum SeriesIndex : std::size_t {
  kTracked,
  kTrackingTime,
  kMappingTime,
  kObjects,
  kKeyframes,
  kPoints,
  kBoxes,
};

std::optional<double> Measured(double milliseconds) {
  return milliseconds > 0.0 ? std::optional(milliseconds) : std::nullopt;
}

}  // namespace

bool Series::HasValues() const {
  return std::any_of(value.begin(), value.end(), [](const auto& v) { return v.has_value(); });
}

std::pair<double, double> Series::Range() const {
  std::optional<std::pair<double, double>> range;
  for (const std::optional<double>& v : value) {
    if (v) {
      range = range ? std::pair(std::min(range->first, *v), std::max(range->second, *v)) : std::pair(*v, *v);
    }
  }
  return range.value_or(std::pair(0.0, 0.0));
}

std::optional<double> Series::At(double frame_index) const {
  const auto after = std::upper_bound(frame.begin(), frame.end(), frame_index);
  return after == frame.begin() ? std::nullopt : value[static_cast<std::size_t>(after - frame.begin()) - 1];
}

std::string_view MarkName(RunMark::Kind kind) {
  switch (kind) {
    case RunMark::Kind::kKeyframe:
      return "keyframe";
    case RunMark::Kind::kLoop:
      return "loop closed";
    case RunMark::Kind::kMerge:
      return "maps merged";
    case RunMark::Kind::kLost:
      return "tracking lost";
    case RunMark::Kind::kFoundAgain:
      return "tracking found again";
  }
  return "";
}

RunSeries::RunSeries() {
  series_.resize(7);
  const auto name = [this](SeriesIndex index, const char* text, const char* unit = "") {
    series_[index].name = text;
    series_[index].unit = unit;
  };
  name(kTracked, "tracked points");
  name(kTrackingTime, "tracking", "ms");
  name(kMappingTime, "mapping", "ms");
  name(kObjects, "objects");
  name(kKeyframes, "keyframes");
  name(kPoints, "map points");
  name(kBoxes, "boxes with an object");
}

void RunSeries::Push(std::size_t series, const MapSnapshot& map, std::optional<double> value) {
  series_[series].frame.push_back(static_cast<double>(map.frame_index));
  series_[series].time.push_back(map.timestamp);
  series_[series].value.push_back(value);
}

void RunSeries::Add(const MapSnapshot& map) {
  const std::optional<SnapshotProgress>& progress = map.progress;
  Push(kTracked, map, progress ? std::optional<double>(progress->tracked_points) : std::nullopt);
  Push(kTrackingTime, map, progress ? Measured(progress->tracking_ms) : std::nullopt);
  Push(kMappingTime, map, progress ? Measured(progress->mapping_ms) : std::nullopt);
  Push(kObjects, map, static_cast<double>(map.objects.size()));
  Push(kKeyframes, map, static_cast<double>(map.keyframes.size()));
  Push(kPoints, map, static_cast<double>(map.points.size()));
  const auto of_objects = std::count_if(map.detections.begin(), map.detections.end(),
                                        [](const auto& seen) { return seen.object_id >= 0; });
  Push(kBoxes, map, static_cast<double>(of_objects));

  const auto mark = [&](RunMark::Kind kind) { events_.push_back({kind, map.frame_index, map.timestamp}); };
  if (progress) {
    if (progress->counters.loops > last_.counters.loops) {
      mark(RunMark::Kind::kLoop);
    }
    if (progress->counters.merges > last_.counters.merges) {
      mark(RunMark::Kind::kMerge);
    }
    last_ = *progress;
  }
  if (map.T_map_camera.has_value() != tracked_) {
    tracked_ = map.T_map_camera.has_value();
    mark(tracked_ ? RunMark::Kind::kFoundAgain : RunMark::Kind::kLost);
  }
  keyframes_.clear();
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    keyframes_.push_back({RunMark::Kind::kKeyframe, keyframe.frame_index, keyframe.timestamp});
  }
}

const Series& RunSeries::Named(std::string_view name) const {
  const auto found = std::find_if(series_.begin(), series_.end(),
                                  [name](const Series& series) { return series.name == name; });
  if (found == series_.end()) {
    throw std::out_of_range("no series " + std::string(name));
  }
  return *found;
}

std::vector<RunMark> RunSeries::Marks() const {
  std::vector<RunMark> marks = keyframes_;
  marks.insert(marks.end(), events_.begin(), events_.end());
  std::stable_sort(marks.begin(), marks.end(),
                   [](const RunMark& a, const RunMark& b) { return a.frame_index < b.frame_index; });
  return marks;
}

RunSeries ReadRunSeries(const RecordingReader& recording, const PassProgress& progress) {
  RunSeries series;
  for (int i = 0; i < recording.Size(); ++i) {
    series.Add(*recording.Read(i));
    if (progress && !progress(i + 1, recording.Size())) {
      break;
    }
  }
  return series;
}

}  // namespace sqslam::viewer
