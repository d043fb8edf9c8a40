#include "slam/tracking/relocalizer.h"

#include <algorithm>
#include <utility>

#include "slam/tracking/object_poses.h"

namespace sqslam {
namespace {

// Returns the keyframe nearest to a camera; keyframes that look in the same direction come first.
KeyframeId KeyframeNear(const TrackingView& view, const Rigid3d& T_camera_map) {
  constexpr double kMinCosine = 0.7;  // between the optical axes
  const Rigid3d T_map_camera = T_camera_map.Inverse();
  const auto rank = [&](const auto& entry) {
    const Rigid3d T_map_keyframe = entry.second.pose.T_camera_map.Inverse();
    const double cosine = (T_map_keyframe.rotation * Eigen::Vector3d::UnitZ())
                              .dot(T_map_camera.rotation * Eigen::Vector3d::UnitZ());
    return std::pair(cosine <= kMinCosine, (T_map_keyframe.translation - T_map_camera.translation).norm());
  };
  return std::ranges::min_element(view.keyframes, {}, rank)->first;
}

}  // namespace

void Relocalizer::UpdateIndex(const AtlasViewPtr& atlas, const TrackingViewPtr& view) {
  auto views = atlas ? atlas->submaps : std::map<std::int64_t, TrackingViewPtr>();
  views[view->submap] = view;
  if (views == views_) {
    return;
  }
  views_ = std::move(views);
  std::erase_if(submap_of_, [&](const auto& entry) {
    const auto submap = views_.find(entry.second);
    const bool gone = submap == views_.end() || !submap->second->keyframes.contains(entry.first);
    if (gone) {
      index_.Remove(entry.first);
    }
    return gone;
  });
  for (const auto& [submap, submap_view] : views_) {
    for (const auto& [id, keyframe] : submap_view->keyframes) {
      if (keyframe.words && submap_of_.emplace(id, submap).second) {
        index_.Add(id, *keyframe.words);
      }
    }
  }
}

std::vector<Relocalizer::Candidate> Relocalizer::Candidates(const AtlasViewPtr& atlas,
                                                            const TrackingViewPtr& view,
                                                            const std::optional<TrackedFrame>& last,
                                                            const TrackedFrame& frame) {
  constexpr int kCandidates = 5;
  std::vector<Candidate> candidates;
  const KeyframeId last_reference = last ? last->anchor.reference : kNoKeyframe;
  if (view->keyframes.contains(last_reference)) {
    candidates.push_back({view, last_reference});
  }
  UpdateIndex(atlas, view);
  if (!vocabulary_) {
    return candidates;
  }
  const BagOfWords words = vocabulary_->Transform(frame.features->descriptors);
  PlaceQuery query;
  query.bow = &words;
  query.max_candidates = kCandidates;
  query.exclude = [&](KeyframeId id) { return id == last_reference; };
  for (const PlaceCandidate& candidate : index_.Query(query)) {
    candidates.push_back({views_.at(submap_of_.at(candidate.id)), candidate.id});
  }
  return candidates;
}

std::optional<Relocalizer::Found> Relocalizer::ByWords(const PoseTracker& tracker, const AtlasViewPtr& atlas,
                                                       const TrackingViewPtr& view,
                                                       const std::optional<TrackedFrame>& last,
                                                       const TrackedFrame& frame) {
  std::optional<Found> best;
  for (const auto& [place, id] : Candidates(atlas, view, last, frame)) {
    TrackedFrame located = frame;
    if (tracker.Relocate(*place, place->keyframes.at(id), located) &&
        (!best || located.inliers > best->frame.inliers)) {
      best = {located, place};
    }
  }
  return best;
}

std::optional<Relocalizer::Found> Relocalizer::ByObjects(const PoseTracker& tracker, const Camera& camera,
                                                         const std::vector<BoxCandidate>& boxes,
                                                         const TrackedFrame& frame) const {
  constexpr int kMaxPoses = 5;
  constexpr double kSearchRadius = 0.08;  // of the image width: boxes give a rough pose
  std::optional<Found> best;
  for (const auto& [submap, view] : views_) {
    if (!view->objects || view->keyframes.empty()) {
      continue;
    }
    for (const Rigid3d& T_camera_map : PosesFromObjects(boxes, *view->objects, camera, kMaxPoses)) {
      TrackedFrame located = frame;
      if (tracker.LocateNear(*view, T_camera_map, KeyframeNear(*view, T_camera_map),
                             kSearchRadius * camera.width, located) &&
          (!best || located.inliers > best->frame.inliers)) {
        best = {located, view};
      }
    }
  }
  return best;
}

}  // namespace sqslam
