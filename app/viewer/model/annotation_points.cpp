#include "app/viewer/model/annotation_points.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "app/viewer/model/annotation.h"
#include "slam/fitting/fitting.h"
#include "slam/fitting/fixed_shape_fit.h"
#include "slam/fitting/surface_measures.h"
#include "slam/io/point_cloud.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam::viewer {
namespace {

template <typename Predicate>
std::vector<int> Select(std::span<const Eigen::Vector3d> points, Predicate predicate) {
  std::vector<int> chosen;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (predicate(points[i])) {
      chosen.push_back(static_cast<int>(i));
    }
  }
  return chosen;
}

}  // namespace

Points ReadPoints(const std::filesystem::path& path, const Sim3d& S_annotation_file) {
  Points points = ReadPointCloud(path).points;
  for (Eigen::Vector3d& p : points) {
    p = S_annotation_file * p;
  }
  return points;
}

std::vector<int> SelectInBox(std::span<const Eigen::Vector3d> points, const SelectionBox& box) {
  const Rigid3d T_box_map = box.T_map_box.Inverse();
  return Select(points, [&](const Eigen::Vector3d& p) {
    return ((T_box_map * p).cwiseAbs().array() <= box.half_size.array()).all();
  });
}

std::vector<int> SelectInLasso(std::span<const Eigen::Vector3d> points,
                               std::span<const Eigen::Vector2d> polygon, const Camera& camera,
                               const Rigid3d& T_map_camera) {
  const std::vector<cv::Point2f> contour = ToVector(polygon, [](const Eigen::Vector2d& corner) {
    return cv::Point2f(cv::Point2d(corner.x(), corner.y()));
  });
  const Rigid3d T_camera_map = T_map_camera.Inverse();
  return Select(points, [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3d p_camera = T_camera_map * p;
    const Eigen::Vector2d pixel = camera.ProjectDistorted(p_camera);
    return p_camera.z() > 0.0 && !contour.empty() &&
           cv::pointPolygonTest(contour, cv::Point2d(pixel.x(), pixel.y()), false) >= 0.0;
  });
}

std::vector<int> AboveGround(std::span<const Eigen::Vector3d> points, std::span<const int> chosen,
                             double ground, double margin) {
  std::vector<int> above;
  std::ranges::copy_if(chosen, std::back_inserter(above), [&](int index) {
    return points[static_cast<std::size_t>(index)].z() > ground + margin;
  });
  return above;
}

std::vector<int> Combine(std::span<const int> old, std::span<const int> chosen, SelectMode mode) {
  std::vector<int> combined;
  if (mode == SelectMode::kAdd) {
    std::set_union(old.begin(), old.end(), chosen.begin(), chosen.end(), std::back_inserter(combined));
  } else if (mode == SelectMode::kRemove) {
    std::set_difference(old.begin(), old.end(), chosen.begin(), chosen.end(), std::back_inserter(combined));
  } else {
    combined.assign(chosen.begin(), chosen.end());
  }
  return combined;
}

std::optional<double> GroundHeight(const MapSnapshot& map) {
  return map.support_height ? map.support_height : GroundHeight(PositionsOf(map));
}

std::optional<double> GroundHeight(std::span<const Eigen::Vector3d> points) {
  constexpr double kPlaneThickness = 0.01;  // of the plane, relative to the RMS radius of the cloud
  if (points.empty()) {
    return std::nullopt;
  }
  const Eigen::Map<const Eigen::Matrix3Xd> cloud(points.front().data(), 3, std::ssize(points));
  const Eigen::Vector3d mean = cloud.rowwise().mean();
  const double spread = std::sqrt((cloud.colwise() - mean).colwise().squaredNorm().mean());
  const std::optional<Plane> plane =
      FindLargestPlane(std::vector(points.begin(), points.end()), kPlaneThickness * spread, true, 0);
  if (!plane) {
    return std::nullopt;
  }
  return (plane->offset - plane->normal.head<2>().dot(mean.head<2>())) / plane->normal.z();
}

Points PointsAt(std::span<const Eigen::Vector3d> points, std::span<const int> chosen) {
  return ToVector(chosen, [&](int index) { return points[static_cast<std::size_t>(index)]; });
}

namespace {

constexpr std::size_t kMinPoints = 6;
constexpr int kStartYaws = 9;  // start values over a quarter turn

// Returns the box of this yaw around the points, ignoring the outermost 0.5 % at each side.
Solid BoxAround(std::span<const Eigen::Vector3d> points, SolidKind kind, double yaw) {
  constexpr double kExcludedShare = 0.005;
  constexpr double kMinThickness = 0.02;  // of the longest side: the points may all lie in one plane
  const Eigen::Matrix3d R_box_map = Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  Eigen::Vector3d low, high;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), values.begin(),
                   [&](const Eigen::Vector3d& p) { return R_box_map.row(axis).dot(p); });
    std::ranges::sort(values);
    const auto skipped = static_cast<std::size_t>(kExcludedShare * static_cast<double>(values.size()));
    low[axis] = values[skipped];
    high[axis] = values[values.size() - 1 - skipped];
  }
  const double longest = (high - low).maxCoeff();
  ThrowIf<InputError>(!(longest > 0.0), "all points coincide, expected points of a surface");
  const Eigen::Vector3d half = (0.5 * (high - low)).cwiseMax(0.5 * kMinThickness * longest);
  return UprightSolid(kind, R_box_map.transpose() * (0.5 * (low + high)), yaw, half);
}

// Brings yaw to (-45, 45] degrees: a quarter turn with x and y swapped is the same solid.
void NameAxes(Solid& solid) {
  constexpr double kQuarter = 0.5 * std::numbers::pi;
  const double yaw = YawOf(solid);
  const double quarters = std::ceil(yaw / kQuarter - 0.5);
  SetYaw(solid, yaw - quarters * kQuarter);
  if (std::abs(std::remainder(quarters, 2.0)) > 0.5) {
    std::swap(solid.half_size.x(), solid.half_size.y());
  }
}

// Starts from several yaws, since the cost has local minima, and keeps the best. Prefers the smaller of two
// solids that fit about equally well.
Solid FitFixedShape(std::span<const Eigen::Vector3d> points, SolidKind kind, bool round) {
  constexpr double kVolumeWeight = 0.02;
  Solid best;
  double least = std::numeric_limits<double>::infinity();
  const double size = BoxAround(points, kind, 0.0).half_size.mean();
  for (int i = 0; i < (round ? 1 : kStartYaws); ++i) {
    Solid start = BoxAround(points, kind, 0.5 * std::numbers::pi * i / kStartYaws);
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
  // The z axis may point down; turned over, the solid is the same.
  solid.T_map_object.rotation =
      Eigen::AngleAxisd(ToParameters(fit.superquadric)[7], Eigen::Vector3d::UnitZ());
  return solid;
}

}  // namespace

PrimitiveFit FitPrimitive(std::span<const Eigen::Vector3d> points, SolidKind kind,
                          const PrimitiveFitOptions& options) {
  const std::size_t least = kind == SolidKind::kSuperquadric ? 11 : kMinPoints;
  ThrowIf<InputError>(points.size() < least, "{} points, expected {} or more for a {}", points.size(), least,
                      NameOf(kind));
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
