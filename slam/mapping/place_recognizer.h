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

  bool HasVocabulary() const { return vocabulary_ != nullptr; }
  BagOfWords WordsOf(const FrameFeatures& features) const {  // with a vocabulary only
    return vocabulary_->Transform(features.descriptors);
  }

  // Returns a verified loop, if any. `maps`: all submaps; `current` is in maps.front().
  std::optional<LoopCandidate> Recognize(const std::vector<const Map*>& maps, KeyframeId current) const;

  // Returns the loop between two keyframes of one map, if the map points around them confirm it.
  std::optional<LoopCandidate> Verify(const Map& map, KeyframeId current, KeyframeId known) const {
    return VerifyLoop(camera_, options_, map, map.At(current), map, map.At(known));
  }

 private:
  std::vector<PlaceCandidate> FindCandidates(const std::vector<const Map*>& maps,
                                             const Keyframe& current) const;

  Camera camera_;
  LoopOptions options_;
  std::shared_ptr<const Vocabulary> vocabulary_;
  PlaceIndex index_;
};

}  // namespace sqslam
