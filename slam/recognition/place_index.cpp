#include "slam/recognition/place_index.h"

#include <algorithm>

namespace sqslam {

void PlaceIndex::Add(PlaceId id, const BagOfWords& bow) {
  Remove(id);
  int slot = static_cast<int>(keyframes_.size());
  if (free_slots_.empty()) {
    keyframes_.push_back(id);
  } else {
    slot = free_slots_.back();
    free_slots_.pop_back();
    keyframes_[slot] = id;
  }
  slots_[id] = slot;
  const auto before = static_cast<std::ptrdiff_t>(postings_.size());
  for (const WordWeight& entry : bow.words) {
    postings_.push_back({entry.word, slot, entry.weight});
  }
  std::inplace_merge(postings_.begin(), postings_.begin() + before, postings_.end(),
                     [](const Posting& a, const Posting& b) { return a.word < b.word; });
}

void PlaceIndex::Remove(PlaceId id) {
  const auto found = slots_.find(id);
  if (found == slots_.end()) {
    return;
  }
  const int slot = found->second;
  std::erase_if(postings_, [slot](const Posting& posting) { return posting.slot == slot; });
  keyframes_[slot] = kNoPlace;
  free_slots_.push_back(slot);
  slots_.erase(found);
}

std::vector<PlaceCandidate> PlaceIndex::SimilarKeyframes(const PlaceQuery& query) const {
  struct Shared {
    int words = 0;
    double score = 0.0;
  };
  std::vector<Shared> shared(keyframes_.size());
  auto posting = postings_.begin();
  for (const WordWeight& entry : query.bow->words) {
    posting = std::lower_bound(posting, postings_.end(), entry.word,
                               [](const Posting& p, WordId word) { return p.word < word; });
    for (; posting != postings_.end() && posting->word == entry.word; ++posting) {
      Shared& with = shared[posting->slot];
      ++with.words;
      with.score += static_cast<double>(std::min(entry.weight, posting->weight));
    }
  }
  int most = 0;
  for (std::size_t slot = 0; slot < shared.size(); ++slot) {
    if (shared[slot].words > 0 && query.exclude && query.exclude(keyframes_[slot])) {
      shared[slot].words = 0;
    }
    most = std::max(most, shared[slot].words);
  }
  std::vector<PlaceCandidate> similar;
  for (std::size_t slot = 0; slot < shared.size(); ++slot) {
    if (shared[slot].words > 0 && shared[slot].words >= query.min_shared_words * most &&
        shared[slot].score >= query.min_score) {
      similar.push_back({keyframes_[slot], shared[slot].score, shared[slot].score});
    }
  }
  std::ranges::sort(similar, {}, &PlaceCandidate::id);
  return similar;
}

std::vector<PlaceCandidate> PlaceIndex::Query(const PlaceQuery& query) const {
  const std::vector<PlaceCandidate> similar = SimilarKeyframes(query);
  const auto find = [&](PlaceId id) {
    const auto at = std::lower_bound(similar.begin(), similar.end(), id,
                                     [](const PlaceCandidate& c, PlaceId wanted) { return c.id < wanted; });
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
  // A keyframe that is the best of several groups is one candidate, with the best of these groups.
  std::ranges::sort(groups, [](const auto& a, const auto& b) {
    return a.id != b.id ? a.id < b.id : a.group_score > b.group_score;
  });
  groups.erase(
      std::unique(groups.begin(), groups.end(), [](const auto& a, const auto& b) { return a.id == b.id; }),
      groups.end());
  std::ranges::sort(groups, [](const auto& a, const auto& b) {
    return a.score != b.score ? a.score > b.score : a.id < b.id;
  });
  if (static_cast<int>(groups.size()) > query.max_candidates) {
    groups.resize(static_cast<std::size_t>(std::max(0, query.max_candidates)));
  }
  return groups;
}

}  // namespace sqslam
