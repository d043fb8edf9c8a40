#include "slam/tracking/relocalizer.h"

namespace sqslam {

void Relocalizer::Follow(const AtlasViewPtr& atlas, const TrackingViewPtr& view) {
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
  if (!vocabulary_) {
    return candidates;
  }
  Follow(atlas, view);
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

}  // namespace sqslam
