#include "slam/tracking/initializer.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/features/matching.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr int kMinFeatures = 100;  // that the first frame needs
constexpr double kMinFlow = 5.0;   // px, median motion of the matches below which no map is tried
// Median motion, as a share of the image width, above which a first frame gives way to a new one after
// kMaxFrames. A slow camera, such as a drone's high above a town, may need ten times as long to translate
// enough.
constexpr double kMaxFlow = 0.05;
// Limit for the direction of the translation, rad (5 degrees). Bundle adjustment of a map that starts from a
// worse one often ends in a wrong shape: of 25 starts on nine sequences, the five above 0.1 were off by 4 to
// 7 % of the path, all others but one by less than 0.8 %.
constexpr double kMaxDirectionDeviation = 0.087;

// Scales the map to a median depth of 1 in the first keyframe.
void NormalizeScale(Map& map) {
  const Keyframe& first = map.Keyframes().begin()->second;
  std::vector<double> depths;
  for (const MapPoint& point : map.Points()) {
    depths.push_back((first.T_camera_map * point.p_map).z());
  }
  const double scale = 1.0 / UpperMedian(std::move(depths));
  for (const auto& [id, keyframe] : map.Keyframes()) {
    map.At(id).T_camera_map.translation *= scale;
  }
  for (const MapPoint& point : map.Points()) {
    map.Point(point.id).p_map *= scale;
    map.UpdateNormalAndRange(point.id);
  }
}

}  // namespace

std::unique_ptr<Map> MapOfTwoViews(const Camera& camera, std::unique_ptr<Map> map,
                                   const StartView& first_view, const StartView& second_view,
                                   const TwoViewGeometry& geometry,
                                   const std::vector<std::pair<int, int>>& matches, int min_points) {
  constexpr int kBundleIterations = 20;
  const KeyframeId first =
      map->AddKeyframe(first_view.frame_index, first_view.timestamp, {}, first_view.features);
  const KeyframeId second = map->AddKeyframe(second_view.frame_index, second_view.timestamp,
                                             geometry.T_camera2_camera1, second_view.features);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (geometry.points[i]) {
      const PointId point = map->AddPoint(*geometry.points[i], first);
      map->AddObservation(point, first, matches[i].first);
      map->AddObservation(point, second, matches[i].second);
    }
  }
  GlobalBundleAdjustment(*map, camera, kBundleIterations);
  if (map->NumPoints() < min_points) {
    return nullptr;
  }
  for (const MapPoint& point : map->Points()) {
    map->UpdateAppearance(point.id);
  }
  NormalizeScale(*map);
  map->UpdateCovisibility(first);
  map->UpdateCovisibility(second);
  return map;
}

void Initializer::Restart(const StartView& view) {
  settles_ = settles_ || saw_uncertain_;
  start_.reset();
  if (static_cast<int>(view.features->Size()) < kMinFeatures) {
    refusal_ = fmt::format("too little texture ({} features, at least {} needed)", view.features->Size(),
                           kMinFeatures);
    return;
  }
  start_ = view;
  expected_ = ToVector(view.features->keypoints, &Keypoint::pixel);
}

std::vector<std::pair<int, int>> Initializer::MatchToStart(const FrameFeatures& features) {
  std::vector<PredictedPoint> predictions;
  for (std::size_t i = 0; i < start_->features->Size(); ++i) {
    const Keypoint& keypoint = start_->features->keypoints[i];
    predictions.push_back({static_cast<int>(i), expected_[i], options_.search_radius, keypoint.octave,
                           &start_->features->descriptors[i], keypoint.angle});
  }
  auto matches = MatchPredictions(predictions, features, {}, kMaxUnguidedDistance, 0.9);
  if (static_cast<int>(matches.size()) < options_.min_matches) {  // moved farther than the search radius
    constexpr double kRatio = 0.8;
    matches = MatchAll(*start_->features, features, {}, {}, kMaxUnguidedDistance, kRatio);
  }
  for (const auto& [i, keypoint] : matches) {
    expected_[i] = features.keypoints[keypoint].pixel;
  }
  return matches;
}

std::unique_ptr<Map> Initializer::Add(std::int64_t frame_index, double timestamp,
                                      const FrameFeaturesPtr& features) {
  const StartView view{frame_index, timestamp, features};
  if (!start_) {
    Restart(view);
    return nullptr;
  }
  const std::vector<std::pair<int, int>> matches = MatchToStart(*features);
  if (static_cast<int>(matches.size()) < options_.min_matches) {
    refusal_ = "too few matches between frames (too little texture, too much blur or too fast a motion)";
    Restart(view);
    return nullptr;
  }
  std::vector<TwoViewMatch> pairs;
  std::vector<double> flow;
  for (const auto& [i, j] : matches) {
    pairs.push_back({start_->features->keypoints[i].pixel, features->keypoints[j].pixel});
    flow.push_back((pairs.back().pixel1 - pairs.back().pixel2).norm());
  }
  const double median_flow = UpperMedian(flow);
  largest_flow_ = std::max(largest_flow_, median_flow);
  if (frame_index - start_->frame_index > kMaxFrames && median_flow > kMaxFlow * camera_.width) {
    Restart(view);
    return nullptr;
  }
  if (median_flow < kMinFlow) {
    refusal_ = "the camera hardly moves (it must translate)";
    return nullptr;
  }
  TwoViewReport report = EstimateTwoView(camera_, pairs, options_.two_view);
  if (!report.geometry) {
    refusal_ = report.refusal;
    return nullptr;
  }
  const double deviation = report.geometry->direction_deviation;
  if (!settles_ && !(deviation <= kMaxDirectionDeviation)) {
    saw_uncertain_ = true;
    refusal_ = fmt::format("the direction of the motion is uncertain by {:.0f} degrees",
                           std::min(deviation * 180.0 / std::numbers::pi, 90.0));
    return nullptr;
  }
  std::unique_ptr<Map> map = MapOfTwoViews(camera_, std::make_unique<Map>(levels_, ids_), *start_, view,
                                           *report.geometry, matches, options_.two_view.min_points);
  if (map) {
    start_.reset();
  }
  return map;
}

std::string Initializer::Reason() const {
  return fmt::format("{}; largest median image motion between two tried frames {:.1f} px",
                     refusal_.empty() ? "too few frames" : refusal_, largest_flow_);
}

}  // namespace sqslam
