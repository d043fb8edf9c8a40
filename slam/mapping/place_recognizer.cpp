#include "slam/mapping/place_recognizer.h"

#include <algorithm>

#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr int kNeighbours = 10;  // of a keyframe, which make a group with it

// Returns the map that has the keyframe, or null.
const Map* MapOf(const std::vector<const Map*>& maps, KeyframeId id) {
  const auto it = std::ranges::find_if(maps, [&](const Map* map) { return map->HasKeyframe(id); });
  return it != maps.end() ? *it : nullptr;
}

}  // namespace

void PlaceRecognizer::Add(Keyframe& keyframe) {
  if (vocabulary_) {
    keyframe.words = std::make_shared<const BagOfWords>(WordsOf(*keyframe.features));
    index_.Add(keyframe.id, *keyframe.words);
  }
}

std::vector<PlaceCandidate> PlaceRecognizer::FindCandidates(const std::vector<const Map*>& maps,
                                                            const Keyframe& current) const {
  constexpr int kMaxCandidates = 5;  // keyframes compared with the newest
  PlaceQuery query;
  query.bow = current.words.get();
  query.max_candidates = kMaxCandidates;
  query.exclude = [&](KeyframeId id) {
    return id == current.id || current.covisibility.contains(id) || MapOf(maps, id) == nullptr;
  };
  query.covisible = [&](KeyframeId id) {
    const Map* map = MapOf(maps, id);
    return map != nullptr ? map->At(id).BestCovisible(kNeighbours) : std::vector<KeyframeId>{};
  };
  // The same place should score no lower than the least similar covisible keyframe (ORB-SLAM VII-A).
  query.min_score = 1.0;
  for (const auto& [id, weight] : current.covisibility) {
    const BagOfWordsPtr& words = maps.front()->At(id).words;
    query.min_score = std::min(query.min_score, words ? Similarity(*current.words, *words) : 0.0);
  }
  query.min_score = current.covisibility.empty() ? 0.0 : query.min_score;
  return index_.Query(query);
}

std::optional<LoopCandidate> PlaceRecognizer::Recognize(const std::vector<const Map*>& maps,
                                                        KeyframeId current) const {
  const Keyframe& keyframe = maps.front()->At(current);
  if (!keyframe.words) {
    return std::nullopt;
  }
  for (const PlaceCandidate& candidate : FindCandidates(maps, keyframe)) {
    const Map& known_map = *MapOf(maps, candidate.id);
    if (auto loop =
            VerifyLoop(camera_, options_, *maps.front(), keyframe, known_map, known_map.At(candidate.id))) {
      return loop;
    }
  }
  return std::nullopt;
}

}  // namespace sqslam
