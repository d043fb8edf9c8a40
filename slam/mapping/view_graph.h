#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "slam/features/frame_features.h"
#include "slam/geometry/camera.h"
#include "slam/mapping/feature_database.h"
#include "slam/mapping/place_recognizer.h"

namespace sqslam {

// Returns the matches of two images that one motion explains (FindEpipolarSupport). `only_turns`: set if a
// rotation explains nearly all of them.
ImageMatches MatchImages(const Camera& camera, const FrameFeatures& a, const FrameFeatures& b,
                         FeatureDatabase& database, bool& only_turns);

// Images and the matches of their keypoints, without any pose: what structure from motion starts from
// (Schoenberger and Frahm 2016, Structure-from-motion revisited, section 4.1). Two images are compared if
// they follow each other or look alike, and matched if an essential matrix explains enough of their
// keypoints.
class ViewGraph {
 public:
  // `database`: shared with other graphs of the same images; null: its own.
  ViewGraph(const Camera& camera, const PlaceRecognizer& places,
            std::shared_ptr<FeatureDatabase> database = nullptr)
      : camera_(camera),
        places_(places),
        database_(database ? std::move(database) : std::make_shared<FeatureDatabase>()) {}

  // `group`: images of one group have poses in one map already and are not compared; negative: none.
  void Add(std::int64_t index, FrameFeaturesPtr features, std::int64_t group = -1);

  // Compares the images on all processors, until `stop` (may be empty) returns true.
  void Match(const std::function<bool()>& stop = {});

  // Returns the matches of an image by the index of the other one.
  const std::map<std::int64_t, ImageMatches>& MatchesOf(std::int64_t index) const;

  const FrameFeatures& FeaturesOf(std::int64_t index) const { return *images_.at(index).features; }

 private:
  struct Image {
    FrameFeaturesPtr features;
    std::int64_t group = -1;
    std::map<std::int64_t, ImageMatches> matches;
  };

  struct Comparison {
    ImageMatches matches;
    bool only_turns = false;
  };
  using ImagePair = std::pair<std::int64_t, std::int64_t>;

  std::set<ImagePair> Candidates() const;
  Comparison Compare(const FrameFeatures& a, const FrameFeatures& b) const;
  bool MatchPairs(const std::vector<ImagePair>& pairs, const std::function<bool()>& stop);

  Camera camera_;
  const PlaceRecognizer& places_;
  std::shared_ptr<FeatureDatabase> database_;
  std::map<std::int64_t, Image> images_;  // by index
};

}  // namespace sqslam
