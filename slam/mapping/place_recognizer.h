#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/map/map.h"
#include "slam/mapping/loop_options.h"
#include "slam/recognition/place_index.h"
#include "slam/recognition/vocabulary.h"

namespace sqslam {

// A keyframe that shows a place which other keyframes know already, although nothing in the map says so.
struct KnownPlace {
  KeyframeId current = kNoKeyframe;
  KeyframeId known = kNoKeyframe;  // in the same map or in another one
  Sim3d S_current_known;           // from the known keyframe's camera to the current one's, units of each map
  std::vector<PointId> known_points;               // of the known keyframe and its neighbours
  std::vector<std::pair<PointId, int>> confirmed;  // of these, what the current keyframe shows: its keypoint
};

// Recognises places among the keyframes of all submaps: by their words, then by geometry (ORB-SLAM,
// Mur-Artal et al. 2015, VII A-B).
class PlaceRecognizer {
 public:
  // `vocabulary`: null turns recognition off.
  PlaceRecognizer(const Camera& camera, const LoopOptions& options,
                  std::shared_ptr<const Vocabulary> vocabulary)
      : camera_(camera), options_(options), vocabulary_(std::move(vocabulary)) {}

  // Gives the keyframe its words and makes it known. Does nothing without a vocabulary.
  void Add(Keyframe& keyframe);
  void Remove(KeyframeId keyframe) { index_.Remove(keyframe); }

  // `maps`: all submaps; `current` is in maps.front().
  std::optional<KnownPlace> Recognize(const std::vector<const Map*>& maps, KeyframeId current) const;

 private:
  struct Candidate {
    const Map* map = nullptr;
    KeyframeId id = kNoKeyframe;
  };
  std::vector<Candidate> FindCandidates(const std::vector<const Map*>& maps, const Keyframe& current) const;
  std::optional<KnownPlace> Verify(const Map& map, const Keyframe& current, const Candidate& candidate) const;
  void Confirm(const Keyframe& current, const Map& known_map, double radius, KnownPlace& place) const;

  Camera camera_;
  LoopOptions options_;
  std::shared_ptr<const Vocabulary> vocabulary_;
  PlaceIndex index_;
};

}  // namespace sqslam
