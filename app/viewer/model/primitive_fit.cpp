#include "app/viewer/model/primitive_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "app/viewer/model/annotation.h"
#include "slam/fitting/fitting.h"
#include "slam/fitting/fixed_shape_fit.h"
#include "slam/fitting/surface_measures.h"
#include "slam/util/error.h"

namespace sqslam::viewer {
namespace {

constexpr std::size_t kLeastPoints = 6;
constexpr int kYaws = 9;  // starts over a quarter turn

// A box of this yaw around the points, some of the outermost of each side left out.
Solid BoxAround(std::span<const Eigen::Vector3d> points, SolidKind kind, double yaw) {
  constexpr double kLeftOut = 0.005;
  constexpr double kThinnest = 0.02;  // of the longest side: the points may all lie in one plane
  const Eigen::Matrix3d R_box_map = Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  Eigen::Vector3d low, high;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), values.begin(),
                   [&](const Eigen::Vector3d& p) { return R_box_map.row(axis).dot(p); });
    std::sort(values.begin(), values.end());
    const auto skipped = static_cast<std::size_t>(kLeftOut * static_cast<double>(values.size()));
    low[axis] = values[skipped];
    high[axis] = values[values.size() - 1 - skipped];
  }
  const double longest = (high - low).maxCoeff();
  if (!(longest > 0.0)) {
    throw InputError("the points are all in one place, expected points of a surface");
  }
  const Eigen::Vector3d half = (0.5 * (high - low)).cwiseMax(0.5 * kThinnest * longest);
  return UprightSolid(kind, R_box_map.transpose() * (0.5 * (low + high)), yaw, half);
}

// Yaw in (-45, 45] degrees: a quarter turn with x and y swapped is the same solid.
void NameAxes(Solid& solid) {
  constexpr double kQuarter = 0.5 * std::numbers::pi;
  const double yaw = YawOf(solid);
  const double quarters = std::ceil(yaw / kQuarter - 0.5);
  SetYaw(solid, yaw - quarters * kQuarter);
  if (std::abs(std::remainder(quarters, 2.0)) > 0.5) {
    std::swap(solid.half_size.x(), solid.half_size.y());
  }
}

// Starts at several yaws, since the cost has minima between; the best end is taken. The smaller of two that
// suit the points about as well is the likelier.
Solid FitFixedShape(std::span<const Eigen::Vector3d> points, SolidKind kind, bool round) {
  constexpr double kVolumeWeight = 0.02;
  Solid best;
  double least = std::numeric_limits<double>::infinity();
  const double size = BoxAround(points, kind, 0.0).half_size.mean();
  for (int i = 0; i < (round ? 1 : kYaws); ++i) {
    Solid start = BoxAround(points, kind, 0.5 * std::numbers::pi * i / kYaws);
    if (round) {
      start.half_size.head<2>().setConstant(start.half_size.head<2>().mean());
    }
    const PosedSuperquadric fitted =
        FitPlaceAndSize(points, AsSuperquadric(start), {.yaw = !round, .round = round});
    const double cost = MeanPointCost(points, fitted, size) +
                        kVolumeWeight * std::log(fitted.shape.half_size.prod() / (size * size * size));
    if (cost < least) {
      least = cost;
      best = start;
      best.half_size = fitted.shape.half_size;
      best.T_map_object = fitted.T_map_object;
    }
  }
  return best;
}

Solid FitFreeShape(std::span<const Eigen::Vector3d> points) {
  FitOptions options;
  options.upright = true;
  const SuperquadricFit fit = FitSuperquadric(points, options);
  Solid solid = Solid::FromSuperquadric(fit.superquadric);
  // The z axis may have come out downwards; turned over, the solid is the same.
  solid.T_map_object.rotation =
      Eigen::AngleAxisd(ToParameters(fit.superquadric)[7], Eigen::Vector3d::UnitZ());
  return solid;
}

}  // namespace

PrimitiveFit FitPrimitive(std::span<const Eigen::Vector3d> points, SolidKind kind,
                          const PrimitiveFitOptions& options) {
  const std::size_t least = kind == SolidKind::kSuperquadric ? 11 : kLeastPoints;
  if (points.size() < least) {
    throw InputError(
        fmt::format("{} points, expected {} or more for a {}", points.size(), least, KindName(kind)));
  }
  PrimitiveFit fit;
  fit.points = static_cast<int>(points.size());
  fit.solid = kind == SolidKind::kSuperquadric
                  ? FitFreeShape(points)
                  : FitFixedShape(points, kind, kind == SolidKind::kCylinder && options.round);
  NameAxes(fit.solid);
  if (options.ground) {
    SnapToGround(fit.solid, *options.ground, GroundSnap::kExtend);
  }
  const PosedSuperquadric superquadric = AsSuperquadric(fit.solid);
  const SurfaceDistance distance(superquadric.shape);
  const Rigid3d T_object_map = superquadric.T_map_object.Inverse();
  double squares = 0.0;
  for (const Eigen::Vector3d& p : points) {
    const double d = distance(T_object_map * p);
    squares += d * d;
  }
  fit.rms = std::sqrt(squares / static_cast<double>(points.size()));
  return fit;
}

}  // namespace sqslam::viewer
