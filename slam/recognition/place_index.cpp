#include "slam/recognition/place_index.h"

#include <algorithm>
#include <map>

#include "slam/util/largest.h"
#include "slam/util/to_vector.h"

namespace sqslam {

void PlaceIndex::Add(PlaceId id, const BagOfWords& bow) {
  Remove(id);
  places_[id] = ToVector(bow.words, &WordWeight::word);
  for (const WordWeight& entry : bow.words) {
    postings_[entry.word].push_back({id, entry.weight});
  }
}

void PlaceIndex::Remove(PlaceId id) {
  const auto place = places_.find(id);
  if (place == places_.end()) {
    return;
  }
  for (const WordId word : place->second) {
    std::vector<Posting>& postings = postings_[word];
    std::erase_if(postings, [id](const Posting& posting) { return posting.id == id; });
    if (postings.empty()) {
      postings_.erase(word);
    }
  }
  places_.erase(place);
}

std::vector<PlaceCandidate> PlaceIndex::SimilarKeyframes(const PlaceQuery& query) const {
  struct Shared {
    int words = 0;
    double score = 0.0;
  };
  std::map<PlaceId, Shared> shared;
  for (const WordWeight& entry : query.bow->words) {
    if (const auto found = postings_.find(entry.word); found != postings_.end()) {
      for (const Posting& posting : found->second) {
        Shared& with = shared[posting.id];
        ++with.words;
        with.score += static_cast<double>(std::min(entry.weight, posting.weight));
      }
    }
  }
  std::erase_if(shared, [&](const auto& entry) { return query.exclude && query.exclude(entry.first); });
  const int most = Largest(shared, 0, [](const auto& place) { return place.second.words; });
  std::vector<PlaceCandidate> similar;
  for (const auto& [id, with] : shared) {
    if (with.words >= query.min_shared_words * most && with.score >= query.min_score) {
      similar.push_back({id, with.score, with.score});
    }
  }
  return similar;
}

std::vector<PlaceCandidate> PlaceIndex::Query(const PlaceQuery& query) const {
  const std::vector<PlaceCandidate> similar = SimilarKeyframes(query);
  const auto find = [&](PlaceId id) {
    const auto at = std::ranges::lower_bound(similar, id, {}, &PlaceCandidate::id);
    return at != similar.end() && at->id == id ? &*at : nullptr;
  };
  std::vector<PlaceCandidate> groups;  // each with its best keyframe
  double best_group = 0.0;
  for (const PlaceCandidate& seed : similar) {
    PlaceCandidate best = seed;
    double total = seed.score;
    for (const PlaceId neighbor : query.covisible ? query.covisible(seed.id) : std::vector<PlaceId>{}) {
      const PlaceCandidate* member = neighbor == seed.id ? nullptr : find(neighbor);
      if (member != nullptr) {
        total += member->score;
        if (member->score > best.score || (member->score == best.score && member->id < best.id)) {
          best = *member;
        }
      }
    }
    best.group_score = total;
    best_group = std::max(best_group, total);
    groups.push_back(best);
  }
  std::erase_if(groups, [&](const auto& g) { return g.group_score < query.min_group_score * best_group; });
  // If a keyframe is the best of several groups, only the best of these groups stays.
  std::ranges::sort(groups, [](const auto& a, const auto& b) {
    return a.id != b.id ? a.id < b.id : a.group_score > b.group_score;
  });
  const auto same = std::ranges::unique(groups, {}, &PlaceCandidate::id);
  groups.erase(same.begin(), same.end());
  std::ranges::sort(groups, [](const auto& a, const auto& b) {
    return a.score != b.score ? a.score > b.score : a.id < b.id;
  });
  if (static_cast<int>(groups.size()) > query.max_candidates) {
    groups.resize(static_cast<std::size_t>(std::max(0, query.max_candidates)));
  }
  return groups;
}

}  // namespace sqslam
