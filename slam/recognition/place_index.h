#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <unordered_map>
#include <vector>

#include "slam/recognition/vocabulary.h"

namespace sqslam {

using PlaceId = std::int64_t;  // the caller's id of an image, such as that of its keyframe
inline constexpr PlaceId kNoPlace = -1;

// An image to look for. The functions are called a few times per query, from the calling thread.
struct PlaceQuery {
  const BagOfWords* bow = nullptr;
  std::function<bool(PlaceId)> exclude;                    // not to be found; empty: none
  std::function<std::vector<PlaceId>(PlaceId)> covisible;  // empty: every keyframe is its own group
  double min_score = 0.0;                                  // least score of a candidate, in [0, 1]
  double min_shared_words = 0.8;                           // share of the most words shared
  double min_group_score = 0.75;                           // share of the best group's score
  int max_candidates = 10;
};

struct PlaceCandidate {
  PlaceId id = kNoPlace;
  double score = 0.0;        // Similarity to the query
  double group_score = 0.0;  // added up over it and its covisible keyframes
  friend bool operator==(const PlaceCandidate&, const PlaceCandidate&) = default;
};

// An inverted index from words to the keyframes that show them, to find those that look like an image without
// visiting all of them. Not guarded against changes while another thread reads.
class PlaceIndex {
 public:
  // An id that is there already is replaced.
  void Add(PlaceId id, const BagOfWords& bow);
  void Remove(PlaceId id);  // nothing where it is not there
  bool Contains(PlaceId id) const { return places_.contains(id); }
  std::size_t Size() const { return places_.size(); }

  // Places that may be the one in the query, the likeliest first (DBoW2; ORB-SLAM, Mur-Artal et al. 2015,
  // III-D and VI-A): of the keyframes that share at least `min_shared_words` of the most shared words, scores
  // are added up over each and its covisible ones, groups near the best are kept, and of each its best
  // keyframe is returned. Ties are broken by id: the same calls give the same answer.
  std::vector<PlaceCandidate> Query(const PlaceQuery& query) const;

 private:
  struct Posting {
    PlaceId id = kNoPlace;
    float weight = 0.0F;
  };

  std::vector<PlaceCandidate> SimilarKeyframes(const PlaceQuery& query) const;  // by rising id

  std::unordered_map<WordId, std::vector<Posting>> postings_;
  std::set<PlaceId> places_;
};

}  // namespace sqslam
