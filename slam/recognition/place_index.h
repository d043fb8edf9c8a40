#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <unordered_map>
#include <vector>

#include "slam/recognition/vocabulary.h"

namespace sqslam {

using PlaceId = std::int64_t;  // the caller's id of an image, such as its keyframe's
inline constexpr PlaceId kNoPlace = -1;

// An image to look for. The functions are called a few times per query, from the calling thread.
struct PlaceQuery {
  const BagOfWords* bow = nullptr;
  std::function<bool(PlaceId)> exclude;                    // ids to leave out; empty: none
  std::function<std::vector<PlaceId>(PlaceId)> covisible;  // empty: every keyframe is its own group
  double min_score = 0.0;                                  // minimum score of a candidate, in [0, 1]
  double min_shared_words = 0.8;                           // share of the largest number of shared words
  double min_group_score = 0.75;                           // share of the best group's score
  int max_candidates = 10;
};

struct PlaceCandidate {
  PlaceId id = kNoPlace;
  double score = 0.0;        // Similarity to the query
  double group_score = 0.0;  // summed over the keyframe and its covisible ones
  friend bool operator==(const PlaceCandidate&, const PlaceCandidate&) = default;
};

// Inverted index from words to keyframes: finds keyframes similar to an image without visiting all of them.
// Must not change while another thread reads.
class PlaceIndex {
 public:
  // Replaces an id that exists already.
  void Add(PlaceId id, const BagOfWords& bow);
  void Remove(PlaceId id);  // does nothing if it is missing
  bool Contains(PlaceId id) const { return places_.contains(id); }
  std::size_t Size() const { return places_.size(); }
  std::size_t NumWords() const { return postings_.size(); }  // of its keyframes

  // Returns candidate places of the query, the likeliest first (DBoW2; ORB-SLAM, Mur-Artal et al.
  // 2015, III-D and VI-A): among keyframes that share at least `min_shared_words` of the most shared words,
  // sums the scores of each one and its covisible keyframes, keeps groups near the best, and returns the best
  // keyframe of each. Ties are broken by id, for repeatable results.
  std::vector<PlaceCandidate> Query(const PlaceQuery& query) const;

 private:
  struct Posting {
    PlaceId id = kNoPlace;
    float weight = 0.0F;
  };

  std::vector<PlaceCandidate> SimilarKeyframes(const PlaceQuery& query) const;  // ascending ids

  std::unordered_map<WordId, std::vector<Posting>> postings_;
  std::map<PlaceId, std::vector<WordId>> places_;  // with the words of each
};

}  // namespace sqslam
