#include "slam/mapping/view_graph.h"

#include <algorithm>
#include <iterator>

#include "slam/estimation/two_view.h"
#include "slam/features/matching.h"
#include "slam/recognition/place_index.h"
#include "slam/util/parallel.h"

namespace sqslam {

ImageMatches MatchImages(const Camera& camera, const FrameFeatures& a, const FrameFeatures& b,
                         FeatureDatabase& database, bool& only_turns) {
  constexpr double kMaxLineError = 3.0;     // px, of more matches along the lines that the first ones give
  constexpr std::size_t kMaxSupport = 200;  // more matches than that are enough
  const ImageMatches pairs = database.MatchesOf(a, b);
  std::vector<TwoViewMatch> pixels;
  for (const auto& [i, j] : pairs) {
    pixels.push_back({a.keypoints[i].pixel, b.keypoints[j].pixel});
  }
  const EpipolarSupport support = FindEpipolarSupport(camera, pixels);
  only_turns = support.only_turns;
  ImageMatches matches;
  for (const int i : support.inliers) {
    matches.push_back(pairs[i]);
  }
  if (!support.F21.isZero() && matches.size() >= kMinImageMatches && matches.size() <= kMaxSupport) {
    ImageMatches more =
        MatchAlongEpipolarLines(a, b, support.F21, kMaxLineError, kMaxUnguidedDistance, kMaxDistanceRatio);
    if (more.size() > matches.size()) {
      return more;
    }
  }
  return matches;
}

void ViewGraph::Add(std::int64_t index, FrameFeaturesPtr features, std::int64_t group) {
  images_.insert_or_assign(index, Image{std::move(features), group, {}});
}

const std::map<std::int64_t, ImageMatches>& ViewGraph::MatchesOf(std::int64_t index) const {
  static const std::map<std::int64_t, ImageMatches> kNone;
  const auto image = images_.find(index);
  return image != images_.end() ? image->second.matches : kNone;
}

// Few images are all compared; among many, those next in order and those with the most similar words.
std::set<ViewGraph::ImagePair> ViewGraph::Candidates() const {
  constexpr std::size_t kMaxImagesAllCompared = 40;
  constexpr int kNext = 4;      // images after each one
  constexpr int kSimilar = 12;  // images for each one
  std::set<ImagePair> pairs;
  const auto add = [&](std::int64_t a, std::int64_t b) {
    const std::int64_t group = images_.at(a).group;
    if (a != b && (group < 0 || group != images_.at(b).group)) {
      pairs.insert(std::minmax(a, b));
    }
  };
  std::map<std::int64_t, BagOfWords> words;
  PlaceIndex index;
  const bool few = images_.size() <= kMaxImagesAllCompared;
  for (const auto& [id, image] : images_) {
    if (!few && places_.HasVocabulary()) {
      words[id] = places_.WordsOf(*image.features);
      index.Add(id, words[id]);
    }
  }
  for (auto image = images_.begin(); image != images_.end(); ++image) {
    int steps = 0;
    for (auto next = std::next(image); next != images_.end() && (few || steps < kNext); ++next, ++steps) {
      add(image->first, next->first);
    }
    if (const auto bow = words.find(image->first); bow != words.end()) {
      PlaceQuery query;
      query.bow = &bow->second;
      query.min_shared_words = 0.3;
      query.min_group_score = 0.0;
      query.max_candidates = kSimilar;
      const std::int64_t group = image->second.group;
      query.exclude = [&](PlaceId id) {
        return id == image->first || (group >= 0 && images_.at(id).group == group);
      };
      for (const PlaceCandidate& similar : index.Query(query)) {
        add(image->first, similar.id);
      }
    }
  }
  return pairs;
}

ViewGraph::Comparison ViewGraph::Compare(const FrameFeatures& a, const FrameFeatures& b) const {
  Comparison comparison;
  comparison.matches = MatchImages(camera_, a, b, *database_, comparison.only_turns);
  if (comparison.matches.size() < kMinImageMatches) {
    comparison.matches.clear();
  }
  return comparison;
}

// Returns true if any of the pairs shows that the camera has translated.
bool ViewGraph::MatchPairs(const std::vector<ImagePair>& pairs, const std::function<bool()>& stop) {
  constexpr std::size_t kPart = 64;  // pairs between two calls of `stop`, which belongs to this thread
  std::vector<Comparison> compared(pairs.size());
  for (std::size_t begin = 0; begin < pairs.size() && !(stop && stop()); begin += kPart) {
    ParallelFor(std::min(kPart, pairs.size() - begin), 0, [&](std::size_t k) {
      const auto& [first, second] = pairs[begin + k];
      compared[begin + k] = Compare(FeaturesOf(first), FeaturesOf(second));
    });
  }
  bool translates = false;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    ImageMatches& matches = compared[i].matches;
    if (matches.empty()) {
      continue;
    }
    translates = translates || !compared[i].only_turns;
    ImageMatches& backward = images_.at(pairs[i].second).matches[pairs[i].first];
    for (const auto& [a, b] : matches) {
      backward.emplace_back(b, a);
    }
    images_.at(pairs[i].first).matches[pairs[i].second] = std::move(matches);
  }
  return translates;
}

void ViewGraph::Match(const std::function<bool()>& stop) {
  // The images of a camera that stands still or only turns all match, and none of the pairs leads to a map: a
  // sample of them tells.
  constexpr std::size_t kEvery = 16;
  const auto candidates = Candidates();
  std::vector<ImagePair> sample;
  std::vector<ImagePair> others;
  for (std::size_t i = 0; const ImagePair& pair : candidates) {
    (i++ % kEvery == 0 ? sample : others).push_back(pair);
  }
  if (MatchPairs(sample, stop) || sample.size() < kEvery) {
    MatchPairs(others, stop);
  }
}

}  // namespace sqslam
