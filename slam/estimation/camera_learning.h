#pragma once

#include <array>

#include "slam/geometry/camera.h"
#include "slam/map/map.h"

namespace sqslam {

// Camera parameters that are refined from a map: the focal length, and the first two radial coefficients.
enum class LearntPart { kNone, kFocal, kFocalAndRadial };
constexpr auto EnumNames(LearntPart) { return std::array{"none", "focal", "focal+radial"}; }

// Knowledge of a focal length without images.
struct FocalPrior {
  double focal = 0.0;      // px, the median; 0: that of the assumed camera
  double deviation = 0.3;  // standard deviation of the logarithm
};

// Options of camera self-calibration from a map.
struct CameraLearningOptions {
  LearntPart what = LearntPart::kNone;
  double max_deviation = 0.15;  // largest accepted standard deviation, in focal lengths
  FocalPrior prior;             // cannot be set by a configuration

  void VisitFields(auto&& visit) {
    visit("what", what);
    visit("max_deviation", max_deviation, 0.0, 1.0);
  }
};

// Estimate of the log focal length over that of the assumed camera.
struct FocalEstimate {
  double log_change = 0.0;
  double deviation = 0.0;  // standard deviation
};

// Combines the estimate from all images and those from the first and the second half of them, which share no
// image, with the prior. The deviation grows by as much as the halves disagree beyond their own deviations
// (Birge ratio: R. T. Birge, "The Calculation of Errors by the Method of Least Squares", Phys. Rev. 1932),
// and by what no map shows: see the constants there.
FocalEstimate CombineEstimates(const FocalEstimate& whole, const std::array<FocalEstimate, 2>& halves,
                               const FocalEstimate& prior);

// Returns the bounds between which a focal length lies with a probability of 95 %; `deviation`: standard
// deviation of its logarithm.
std::array<double, 2> FocalInterval(double focal, double deviation);

// Result of LearnCamera().
struct LearntCamera {
  Camera camera;           // unchanged if not trusted
  double focal = 0.0;      // px, the estimate, trusted or not
  double deviation = 0.0;  // standard deviation of its logarithm
  bool trusted = false;
  double mean_squared_error = 0.0;  // of keypoints, in variances, each limited
};

// Estimates focal length and two radial coefficients from a map, with the principal point and the readout
// time of the rows unknown too. If the result is trusted, the map is adjusted to the camera with the learnt
// part; its keypoints stay undistorted as they were: maps that will be saved should learn the focal length
// alone.
LearntCamera LearnCamera(Map& map, const Camera& camera, const CameraLearningOptions& options);

}  // namespace sqslam
