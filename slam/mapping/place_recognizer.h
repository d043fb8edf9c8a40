#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/map/map.h"
#include "slam/mapping/loop_verification.h"
#include "slam/mapping/mapping_options.h"
#include "slam/recognition/place_index.h"
#include "slam/recognition/vocabulary.h"

namespace sqslam {

// Recognises places among the keyframes of all submaps: bag of words for candidates, geometry for
// verification (ORB-SLAM, Mur-Artal et al. 2015, VII A-B).
class PlaceRecognizer {
 public:
  // A null `vocabulary` turns recognition off.
  PlaceRecognizer(const Camera& camera, const LoopOptions& options,
                  std::shared_ptr<const Vocabulary> vocabulary)
      : camera_(camera), options_(options), vocabulary_(std::move(vocabulary)) {}

  // Computes the keyframe's bag of words and indexes it. Does nothing without a vocabulary.
  void Add(Keyframe& keyframe);
  void Remove(KeyframeId keyframe) { index_.Remove(keyframe); }

  // Returns the keyframes of one map most similar to an image, best first.
  std::vector<KeyframeId> MostSimilar(const Map& map, const FrameFeatures& features, int count) const;

  // Returns a verified loop, if any. `maps`: all submaps; `current` is in maps.front().
  std::optional<LoopCandidate> Recognize(const std::vector<const Map*>& maps, KeyframeId current) const;

 private:
  std::vector<PlaceCandidate> FindCandidates(const std::vector<const Map*>& maps,
                                             const Keyframe& current) const;

  Camera camera_;
  LoopOptions options_;
  std::shared_ptr<const Vocabulary> vocabulary_;
  PlaceIndex index_;
};

}  // namespace sqslam
