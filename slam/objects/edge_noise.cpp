#include "slam/objects/edge_noise.h"

#include <algorithm>
#include <cmath>

#include "slam/objects/landmark_geometry.h"
#include "slam/util/statistics.h"

namespace sqslam {
namespace {

// Errors of the free edges on one side of an object's boxes, in usual standard deviations.
std::vector<double> ErrorsOnSide(const FittedViews& object, std::size_t edge, const Camera& camera,
                                 const RefinementOptions& options) {
  std::vector<double> errors;
  const bool horizontal = edge % 2 == 0;
  for (const BoxView& view : object.views) {
    const std::optional<Box2d> projected = ProjectToBox(object.hull, object.parts, view.T_map_camera, camera);
    if (!view.edge_free[edge] || !projected) {
      continue;
    }
    const Box2d box = UndistortBox(view.box, camera);
    const double error = NormalisedBounds(box, camera)[edge] - NormalisedBounds(*projected, camera)[edge];
    errors.push_back((horizontal ? camera.fx : camera.fy) * error /
                     EdgeSigma(horizontal ? box.width : box.height, options));
  }
  return errors;
}

// Variance of normally distributed values by the absolute value that four in five stay below: a detector's
// errors have long tails, which the median would not see and single outliers would rule.
double VarianceOf(std::vector<double> errors) {
  constexpr double kShare = 0.8;
  constexpr double kOfNormal = 1.2816;  // this quantile of a standard normal variable
  std::ranges::transform(errors, errors.begin(), [](double error) { return std::abs(error); });
  return std::pow(LinearQuantile(std::move(errors), kShare) / kOfNormal, 2);
}

}  // namespace

double EdgeSigma(double size, const RefinementOptions& options) {
  return options.edge_sigma_px + options.edge_sigma_share * size;
}

double EdgeInformation(std::span<const FittedViews> objects, const Camera& camera,
                       const RefinementOptions& options) {
  constexpr std::size_t kMinViews = 10;  // of a side, to tell its errors from its bias
  std::vector<double> errors;
  std::vector<double> steps;
  for (const FittedViews& object : objects) {
    for (std::size_t edge = 0; edge < 4; ++edge) {
      const std::vector<double> on_side = ErrorsOnSide(object, edge, camera, options);
      if (on_side.size() < kMinViews) {
        continue;
      }
      const double middle = UpperMedian(on_side);
      for (std::size_t i = 0; i < on_side.size(); ++i) {
        errors.push_back(on_side[i] - middle);
        if (i > 0) {
          steps.push_back(on_side[i] - on_side[i - 1]);
        }
      }
    }
  }
  if (errors.empty()) {
    return 1.0;
  }
  const double variance = VarianceOf(std::move(errors));
  const double independent = std::min(variance, 0.5 * VarianceOf(std::move(steps)));  // (1 - r) variance
  const double needed = (2.0 * variance - independent) * variance;
  return independent < needed ? independent / needed : 1.0;
}

}  // namespace sqslam
