#include "app/viewer/model/run_history.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace sqslam::viewer {
namespace {

constexpr double kQuarterTurn = 0.5 * std::numbers::pi;

using Value = std::optional<double>;

struct SeriesKind {
  const char* name;
  const char* unit;
  Value (*value)(const MapSnapshot& map);
};
constexpr std::array<SeriesKind, 5> kSeriesKinds = {{
    {"tracked points", "",
     [](const MapSnapshot& map) {
       return map.progress ? Value(map.progress->tracked_points) : std::nullopt;
     }},
    {"tracking", "ms",
     [](const MapSnapshot& map) {
       const bool timed = map.progress && map.progress->tracking_ms > 0.0;
       return timed ? Value(map.progress->tracking_ms) : std::nullopt;
     }},
    {"objects", "", [](const MapSnapshot& map) { return Value(map.objects.size()); }},
    {"keyframes", "", [](const MapSnapshot& map) { return Value(map.keyframes.size()); }},
    {"map points", "", [](const MapSnapshot& map) { return Value(map.points.size()); }},
}};

}  // namespace

bool Series::HasValues() const {
  return std::ranges::any_of(value, [](const auto& v) { return v.has_value(); });
}

std::pair<double, double> Series::Range() const {
  std::optional<std::pair<double, double>> range;
  for (const Value& v : value) {
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

RunSeries::RunSeries() {
  for (const SeriesKind& kind : kSeriesKinds) {
    series_.push_back({kind.name, kind.unit, {}, {}, {}});
  }
}

void RunSeries::Add(const MapSnapshot& map) {
  for (std::size_t i = 0; i < series_.size(); ++i) {
    series_[i].frame.push_back(static_cast<double>(map.frame_index));
    series_[i].time.push_back(map.timestamp);
    series_[i].value.push_back(kSeriesKinds[i].value(map));
  }
  const auto mark = [&](RunMark::Kind kind) { events_.push_back({kind, map.frame_index, map.timestamp}); };
  if (map.progress) {
    if (map.progress->counters.loops > last_.counters.loops) {
      mark(RunMark::Kind::kLoop);
    }
    if (map.progress->counters.merges > last_.counters.merges) {
      mark(RunMark::Kind::kMerge);
    }
    last_ = *map.progress;
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

void RunSeries::Thin(std::size_t max_values) {
  const auto thin = [](auto& values) {
    const std::size_t half = values.size() / 2;
    for (std::size_t i = 1; i < half; ++i) {
      values[i] = values[2 * i];
    }
    values[half] = values.back();
    values.resize(half + 1);
  };
  for (Series& series : series_) {
    if (series.time.size() > max_values) {
      thin(series.frame);
      thin(series.time);
      thin(series.value);
    }
  }
}

const Series& RunSeries::Named(std::string_view name) const {
  const auto found = std::ranges::find(series_, name, &Series::name);
  if (found == series_.end()) {
    throw std::out_of_range("no series " + std::string(name));
  }
  return *found;
}

std::vector<RunMark> RunSeries::Marks() const {
  std::vector<RunMark> marks = keyframes_;
  marks.insert(marks.end(), events_.begin(), events_.end());
  std::ranges::stable_sort(marks, {}, &RunMark::frame_index);
  return marks;
}

void AddSamples(int snapshot, const MapSnapshot& map, ObjectHistories& histories) {
  for (const SnapshotObject& object : map.objects) {
    const Superquadric& shape = object.superquadric.shape;
    std::vector<ObjectSample>& samples = histories[object.id];
    const long quarters = samples.empty() ? 0 : std::lround((samples.back().yaw - object.yaw) / kQuarterTurn);
    if (quarters != 0) {
      for (ObjectSample& sample : samples) {  // same solids, axes named as in the newest sample
        sample.yaw -= static_cast<double>(quarters) * kQuarterTurn;
        if (quarters % 2 != 0) {
          std::swap(sample.half_size.x(), sample.half_size.y());
        }
      }
    }
    samples.push_back(
        {snapshot, map.frame_index, object.observations, object.yaw, shape.half_size, shape.e1, shape.e2});
  }
}

}  // namespace sqslam::viewer
