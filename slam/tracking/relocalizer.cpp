#include "slam/tracking/relocalizer.h"

#include <algorithm>
#include <opencv2/core.hpp>

namespace sqslam {

std::vector<Relocalizer::Place> Relocalizer::Candidates(const AtlasViewPtr& atlas, std::int64_t submap,
                                                        const TrackingViewPtr& view,
                                                        const std::optional<TrackedFrame>& last,
                                                        const TrackedFrame& frame) const {
  constexpr std::size_t kCount = 4;
  std::map<std::int64_t, TrackingViewPtr> views;
  if (atlas) {
    views = atlas->submaps;
  }
  views[submap] = view;
  struct Ranked {
    double distance;
    Place place;
  };
  std::vector<Ranked> ranked;
  for (const auto& [number, submap_view] : views) {
    for (const auto& [id, keyframe] : submap_view->keyframes) {
      ranked.push_back(
          {cv::norm(frame.features->thumbnail, keyframe.features->thumbnail, cv::NORM_L2SQR), {number, id}});
    }
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Ranked& a, const Ranked& b) { return a.distance < b.distance; });
  std::vector<Place> places;
  if (last && view->keyframes.contains(last->anchor.reference)) {
    places.push_back({submap, last->anchor.reference});
  }
  for (const Ranked& r : ranked) {
    if (places.size() < kCount) {
      places.push_back(r.place);
    }
  }
  return places;
}

}  // namespace sqslam
