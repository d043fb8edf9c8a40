#pragma once

#include <memory>
#include <optional>
#include <string>

#include "slam/map/map.h"
#include "slam/tracking/tracking_options.h"

namespace sqslam {

// One of the two images that a map starts from.
struct StartView {
  std::int64_t frame_index = 0;
  double timestamp = 0.0;
  FrameFeaturesPtr features;
};

// Fills an empty map with two keyframes, unit median depth in the first, refined by bundle adjustment; null
// if fewer than `min_points` points remain. `matches`: those of which `geometry` was estimated.
std::unique_ptr<Map> MapOfTwoViews(const Camera& camera, std::unique_ptr<Map> map, const StartView& first,
                                   const StartView& second, const TwoViewGeometry& geometry,
                                   const std::vector<std::pair<int, int>>& matches, int min_points);

// Starts a map from two frames, as ORB-SLAM does (Mur-Artal et al. 2015, IV): waits until the camera has
// translated enough for a certain direction of motion (or the first frame is out of sight), estimates the
// two-view geometry, triangulates, refines by bundle adjustment and sets the median depth to 1.
class Initializer {
 public:
  static constexpr int kMaxFrames = 60;  // after which a new first frame is chosen, if the camera moves

  Initializer(const Camera& camera, const InitializationOptions& options, const ScaleLevels& levels,
              std::shared_ptr<IdSource> ids = nullptr)
      : camera_(camera), options_(options), levels_(levels), ids_(std::move(ids)) {}

  // Adds a frame. Returns a map of two keyframes once initialization succeeds, null until then.
  std::unique_ptr<Map> Add(std::int64_t frame_index, double timestamp, const FrameFeaturesPtr& features);

  // Discards the first frame, when later frames are unrelated to it.
  void Reset() { start_.reset(); }

  // Returns why there is no map yet, as a message.
  std::string Reason() const;

 private:
  void Restart(const StartView& view);
  std::vector<std::pair<int, int>> MatchToStart(const FrameFeatures& features);

  Camera camera_;
  InitializationOptions options_;
  ScaleLevels levels_;
  std::shared_ptr<IdSource> ids_;
  std::optional<StartView> start_;
  std::vector<Eigen::Vector2d> expected_;  // last matched position of each feature of start_, px
  bool saw_uncertain_ = false;             // a start whose direction of motion is uncertain
  bool settles_ = false;  // for such a start: none better came until the first frame was out of sight
  std::string refusal_;
  double largest_flow_ = 0.0;  // px, of the median over the matches
};

}  // namespace sqslam
