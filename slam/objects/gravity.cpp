#include "slam/objects/gravity.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "slam/geometry/angles.h"
#include "slam/geometry/eigen_system.h"
#include "slam/objects/support.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr double kRollSigma = 15.0 * kRadiansPerDegree;  // people hold a camera level to about this angle

struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double height = 0.0;

  double Distance(const Eigen::Vector3d& p) const { return normal.dot(p) - height; }
};

// Data that candidate planes are scored on.
struct Scene {
  std::span<const Eigen::Vector3d> points;
  std::vector<double> weights;  // of the points, sum 1; those around objects count more
  std::vector<Eigen::Vector3d> camera_centres;
  std::vector<Eigen::Vector3d> camera_rights;
  Eigen::Vector3d mean_up = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> object_centres;
  std::optional<Eigen::Vector3d> vertical;  // direction of vertical edges
  double tolerance = 0.0;                   // map units
};

double MedianDepth(std::span<const Eigen::Vector3d> points, std::span<const Rigid3d> poses) {
  const Rigid3d T_camera_map = poses[poses.size() / 2].Inverse();
  std::vector<double> depths;
  for (const Eigen::Vector3d& p : points) {
    const double depth = (T_camera_map * p).z();
    if (depth > 0.0) {
      depths.push_back(depth);
    }
  }
  return depths.empty() ? 0.0 : UpperMedian(std::move(depths));
}

// Returns the middles of the objects with enough points for one.
std::vector<CloudMiddle> MiddlesOf(std::span<const std::vector<Eigen::Vector3d>> object_points) {
  constexpr std::size_t kMinPoints = 4;
  std::vector<CloudMiddle> middles;
  for (const std::vector<Eigen::Vector3d>& object : object_points) {
    if (object.size() >= kMinPoints) {
      middles.push_back(MiddleOf(object));
    }
  }
  return middles;
}

// Points around an object (within three times its radius) count three times: the plane sought is the one that
// the objects stand on, not the largest one of the room.
std::vector<double> PointWeights(std::span<const Eigen::Vector3d> points,
                                 const std::vector<CloudMiddle>& objects) {
  constexpr double kReach = 3.0;
  constexpr double kGain = 3.0;
  std::vector<double> weights(points.size(), 1.0);
  for (const CloudMiddle& middle : objects) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      if ((points[i] - middle.centre).norm() < kReach * middle.radius) {
        weights[i] = kGain;
      }
    }
  }
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  for (double& weight : weights) {
    weight /= sum;
  }
  return weights;
}

Scene MakeScene(std::span<const Eigen::Vector3d> points, std::span<const Rigid3d> poses,
                const std::vector<CloudMiddle>& objects, const GravityOptions& options) {
  Scene scene;
  scene.points = points;
  scene.weights = PointWeights(points, objects);
  scene.object_centres = ToVector(objects, &CloudMiddle::centre);
  for (const Rigid3d& pose : poses) {
    scene.camera_centres.push_back(pose.translation);
    scene.camera_rights.push_back(pose.rotation * Eigen::Vector3d::UnitX());
    scene.mean_up -= pose.rotation * Eigen::Vector3d::UnitY();
  }
  scene.mean_up.normalize();
  scene.tolerance = options.inlier_share * MedianDepth(points, poses);
  return scene;
}

// Likelihood of the cameras' roll angles and of the vertical edges if `up` is the up direction; 1 for no roll
// and exactly vertical edges.
double Levelness(const Scene& scene, const Eigen::Vector3d& up) {
  constexpr double kEdgeSigma = 3.0 * kRadiansPerDegree;  // backs of chairs lean, cups taper
  double sum = 0.0;
  for (const Eigen::Vector3d& right : scene.camera_rights) {
    const double roll = std::asin(std::clamp(right.dot(up), -1.0, 1.0));
    sum += roll * roll;
  }
  const double mean = sum / static_cast<double>(scene.camera_rights.size());
  const double off = scene.vertical ? (up - *scene.vertical).norm() / kEdgeSigma : 0.0;
  return std::exp(-0.5 * mean / (kRollSigma * kRollSigma)) / (1.0 + off * off);
}

// True if the plane is level, below the cameras (which excludes walls) and not above most objects.
bool IsPlausible(const Scene& scene, const Plane& plane, const GravityOptions& options) {
  if (plane.normal.dot(scene.mean_up) < std::cos(options.max_angle_deg * kRadiansPerDegree)) {
    return false;
  }
  const auto above = [&](const Eigen::Vector3d& c) { return plane.Distance(c) > 2.0 * scene.tolerance; };
  const auto cameras = std::ranges::count_if(scene.camera_centres, above);
  if (static_cast<double>(cameras) < 0.9 * static_cast<double>(scene.camera_centres.size())) {
    return false;
  }
  const auto below = [&](const Eigen::Vector3d& c) { return plane.Distance(c) < -scene.tolerance; };
  const auto objects_below = std::ranges::count_if(scene.object_centres, below);
  return 2 * objects_below <= static_cast<std::ptrdiff_t>(scene.object_centres.size());
}

double Support(const Scene& scene, const Plane& plane, double tolerance) {
  double support = 0.0;
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    // Decreases with the distance, so that of two planes with the same inliers the tighter one wins.
    const double ratio = plane.Distance(scene.points[i]) / tolerance;
    support += scene.weights[i] * std::max(0.0, 1.0 - ratio * ratio);
  }
  return support;
}

// Share of the points that lie a little below the plane. A support is opaque: what is below it is hidden,
// except for the floor, which is far below. A slanted plane through the tops of objects has much below it.
double JustBelow(const Scene& scene, const Plane& plane) {
  double below = 0.0;
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const double distance = plane.Distance(scene.points[i]);
    below += distance < -2.0 * scene.tolerance && distance > -20.0 * scene.tolerance ? scene.weights[i] : 0.0;
  }
  return below;
}

// Returns the plane's score, or 0 if it cannot exceed `best`.
double Score(const Scene& scene, const Plane& plane, double best) {
  constexpr double kBelowWeight = 0.5;
  const double levelness = Levelness(scene, plane.normal);
  const double support = Support(scene, plane, scene.tolerance);
  return support * levelness <= best ? 0.0 : (support - kBelowWeight * JustBelow(scene, plane)) * levelness;
}

std::optional<Plane> PlaneThrough(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c, const Eigen::Vector3d& up) {
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  if (normal.norm() < 1e-12) {
    return std::nullopt;
  }
  Plane plane;
  plane.normal = normal.normalized() * (normal.dot(up) < 0.0 ? -1.0 : 1.0);
  plane.height = plane.normal.dot(a);
  return plane;
}

std::optional<Plane> BestPlane(const Scene& scene, const GravityOptions& options, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::uniform_int_distribution<std::size_t> pick(0, scene.points.size() - 1);
  std::optional<Plane> best;
  double best_score = 0.0;
  for (int i = 0; i < options.ransac_iterations; ++i) {
    const auto plane = PlaneThrough(scene.points[pick(generator)], scene.points[pick(generator)],
                                    scene.points[pick(generator)], scene.mean_up);
    if (!plane || !IsPlausible(scene, *plane, options)) {
      continue;
    }
    const double score = Score(scene, *plane, best_score);
    if (score > best_score) {
      best_score = score;
      best = plane;
    }
  }
  return best;
}

struct Fit {
  Plane plane;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();     // of the points on it
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();  // sum of their weighted squares about the mean
  Eigen::Vector3d spread = Eigen::Vector3d::Zero();   // standard deviations, ascending
  int inliers = 0;
};

// Least-squares plane through the points near `plane`, Tukey-weighted.
std::optional<Fit> FitPlane(const Scene& scene, const Plane& plane, double tolerance) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double sum = 0.0;
  std::vector<double> weights(scene.points.size(), 0.0);
  int inliers = 0;
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const double ratio = plane.Distance(scene.points[i]) / tolerance;
    if (std::abs(ratio) < 1.0) {
      weights[i] = scene.weights[i] * (1.0 - ratio * ratio) * (1.0 - ratio * ratio);
      mean += weights[i] * scene.points[i];
      sum += weights[i];
      ++inliers;
    }
  }
  if (inliers < 3 || sum <= 0.0) {
    return std::nullopt;
  }
  mean /= sum;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const Eigen::Vector3d d = scene.points[i] - mean;
    covariance += weights[i] / sum * d * d.transpose();
  }
  const EigenSystem<3> solver = EigenSystemOf(covariance);
  Fit fit;
  fit.plane.normal = solver.vectors.col(0);
  fit.plane.normal *= fit.plane.normal.dot(plane.normal) < 0.0 ? -1.0 : 1.0;
  fit.plane.height = fit.plane.normal.dot(mean);
  fit.mean = mean;
  fit.scatter = sum * covariance;
  fit.spread = solver.values.cwiseMax(0.0).cwiseSqrt();
  fit.inliers = inliers;
  return fit;
}

// Least-squares plane near `start`, fitted a few times to the points near the last one.
std::optional<Fit> RefinedPlane(const Scene& scene, const Plane& start) {
  constexpr int kRounds = 6;
  std::optional<Fit> fit = Fit{.plane = start};
  for (int i = 0; fit && i < kRounds; ++i) {
    fit = FitPlane(scene, fit->plane, 2.0 * scene.tolerance);
  }
  return fit;
}

constexpr double kMinFlatness = 3.0;  // extent of a plane's points across their longest, in tolerances

bool IsFloor(const Scene& scene, const Plane& plane) {
  constexpr double kWellBelow = 8.0;  // tolerances
  std::vector<double> heights =
      ToVector(scene.points, [&](const Eigen::Vector3d& p) { return plane.Distance(p); });
  std::ranges::sort(heights);
  return sqslam::IsFloor(heights, 0.0, kWellBelow * scene.tolerance);
}

// Returns the floor below the plane found, such as that around a desk, if it is nearly parallel. Its points
// are farther away, so they scatter more.
std::optional<Fit> FloorBelow(const Scene& scene, const Fit& found, const GravityOptions& options,
                              std::uint64_t seed) {
  constexpr double kMaxAngleDeg = 4.0;
  constexpr double kMoreScatter = 3.0;
  constexpr double kBelow = 4.0;  // tolerances
  std::vector<Eigen::Vector3d> points;
  Scene rest = scene;
  rest.weights.clear();
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    if (found.plane.Distance(scene.points[i]) < -kBelow * scene.tolerance) {
      points.push_back(scene.points[i]);
      rest.weights.push_back(scene.weights[i]);
    }
  }
  if (static_cast<int>(points.size()) < options.min_points) {
    return std::nullopt;
  }
  rest.points = points;
  rest.mean_up = found.plane.normal;
  rest.tolerance *= kMoreScatter;
  GravityOptions parallel = options;
  parallel.max_angle_deg = kMaxAngleDeg;
  const std::optional<Plane> start = BestPlane(rest, parallel, seed);
  const std::optional<Fit> fit = start ? RefinedPlane(rest, *start) : std::nullopt;
  const bool is_floor = fit && IsPlausible(rest, fit->plane, parallel) && IsFloor(scene, fit->plane) &&
                        3 * fit->inliers >= options.min_points &&
                        fit->spread[1] > kMinFlatness * rest.tolerance;
  return is_floor ? fit : std::nullopt;
}

// Returns the plane turned to the common normal of both, which the wider one tells better.
Plane LevelWith(const std::optional<Fit>& other, const Fit& fit) {
  Plane plane = fit.plane;
  if (other) {
    const Eigen::Matrix3d scatter = fit.scatter + other->scatter;
    const Eigen::Vector3d normal = EigenSystemOf(scatter).vectors.col(0);
    plane.normal = normal * (normal.dot(plane.normal) < 0.0 ? -1.0 : 1.0);
    plane.height = plane.normal.dot(fit.mean);
  }
  return plane;
}

// Returns the height at or below `highest` whose window holds the most weight, less half the weight just
// below it (see JustBelow).
std::optional<double> BestLevel(const std::vector<std::pair<double, double>>& levels, double window,
                                double highest) {
  constexpr double kMinShare = 0.04;
  std::vector<double> sums(levels.size() + 1, 0.0);
  for (std::size_t i = 0; i < levels.size(); ++i) {
    sums[i + 1] = sums[i] + levels[i].second;
  }
  const auto share_below = [&](double height) {
    const auto it = std::lower_bound(levels.begin(), levels.end(), std::make_pair(height, 0.0));
    return sums[static_cast<std::size_t>(it - levels.begin())];
  };
  double best = 0.0;
  std::optional<double> height;
  for (const auto& [begin, weight] : levels) {
    if (begin > highest) {
      break;
    }
    const double inside = share_below(begin + window) - share_below(begin);
    const double below = share_below(begin - 0.5 * window) - share_below(begin - 10.0 * window);
    if (inside >= kMinShare && inside - 0.5 * below > best) {
      best = inside - 0.5 * below;
      const double middle = share_below(begin) + 0.5 * inside;
      const auto it = std::lower_bound(sums.begin(), sums.end(), middle);
      const auto index = static_cast<std::size_t>(it - sums.begin());
      height = levels[std::min(index, levels.size() - 1)].first;
    }
  }
  return height;
}

}  // namespace

std::optional<SupportPlane> EstimateSupportPlane(std::span<const Eigen::Vector3d> points,
                                                 std::span<const Rigid3d> poses,
                                                 std::span<const std::vector<Eigen::Vector3d>> object_points,
                                                 const GravityOptions& options, std::uint64_t seed,
                                                 const std::optional<Eigen::Vector3d>& vertical) {
  if (static_cast<int>(points.size()) < options.min_points || poses.empty()) {
    return std::nullopt;
  }
  Scene scene = MakeScene(points, poses, MiddlesOf(object_points), options);
  scene.vertical = vertical;
  if (scene.tolerance <= 0.0) {
    return std::nullopt;
  }
  const std::optional<Plane> start = BestPlane(scene, options, seed);
  const std::optional<Fit> fit = start ? RefinedPlane(scene, *start) : std::nullopt;
  if (!fit || !IsPlausible(scene, fit->plane, options)) {
    return std::nullopt;
  }
  // A line of points, or a band of points as thick as it is wide, fixes no plane.
  const double flatness = fit->spread[1] / std::max(scene.tolerance, 1e-12);
  const double support = Support(scene, fit->plane, 2.0 * scene.tolerance);
  if (support < options.min_support || 3 * fit->inliers < options.min_points || flatness < kMinFlatness) {
    return std::nullopt;
  }
  const Plane level = LevelWith(FloorBelow(scene, *fit, options, seed), *fit);
  SupportPlane result;
  result.up = level.normal;
  result.height = level.height;
  result.inliers = fit->inliers;
  result.confidence = std::min(1.0, support / 0.35) * std::min(1.0, flatness / 6.0) *
                      Levelness(scene, level.normal) * std::min(1.0, fit->inliers / 120.0);
  return result;
}

std::optional<double> EstimateSupportHeight(std::span<const Eigen::Vector3d> points,
                                            std::span<const std::vector<Eigen::Vector3d>> object_points,
                                            const GravityOptions& options) {
  if (static_cast<int>(points.size()) < options.min_points) {
    return std::nullopt;
  }
  const std::vector<CloudMiddle> objects = MiddlesOf(object_points);
  const std::vector<double> weights = PointWeights(points, objects);
  std::vector<std::pair<double, double>> levels;  // height, weight
  for (std::size_t i = 0; i < points.size(); ++i) {
    levels.emplace_back(points[i].z(), weights[i]);
  }
  std::ranges::sort(levels);
  const double highest =
      objects.empty()
          ? levels.back().first
          : UpperMedian(ToVector(objects, [](const CloudMiddle& object) { return object.centre.z(); }));
  const double window = 2.0 * options.inlier_share * MiddleOf(points).radius;
  return BestLevel(levels, window, highest);
}

Rigid3d UprightTransform(const Eigen::Vector3d& up) {
  return {RotationBetween(up, Eigen::Vector3d::UnitZ()), Eigen::Vector3d::Zero()};
}

}  // namespace sqslam
