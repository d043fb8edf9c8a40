#include "slam/fitting/fitting.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>
#include <numeric>
#include <random>
#include <type_traits>
#include <utility>

#include "slam/fitting/surface_measures.h"
#include "slam/geometry/eigen_system.h"
#include "slam/util/statistics.h"
#include "slam/util/thinned.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Moments {
  Vector3d mean = Vector3d::Zero();
  Matrix3d covariance = Matrix3d::Zero();
};

Moments WeightedMoments(const std::vector<Vector3d>& points, const auto& weight) {
  Moments moments;
  double sum = 0.0;
  for (const Vector3d& p : points) {
    const double w = weight(p);
    sum += w;
    moments.mean += w * p;
    moments.covariance += w * p * p.transpose();
  }
  moments.mean /= sum;
  moments.covariance = moments.covariance / sum - moments.mean * moments.mean.transpose();
  return moments;
}

// Returns the axis with the sign that makes the robust third moment positive.
Vector3d OrientAxis(const Vector3d& axis, const std::vector<Vector3d>& points, const Vector3d& mean) {
  double third = 0.0;
  for (const Vector3d& p : points) {
    const double x = axis.dot(p - mean);
    third += x * x * x / (1.0 + x * x);
  }
  return third < 0.0 ? Vector3d(-axis) : axis;
}

Matrix3d PrincipalAxes(const Matrix3d& covariance, const std::vector<Vector3d>& points, const Vector3d& mean,
                       bool upright) {
  Matrix3d axes = Matrix3d::Identity();
  if (upright) {
    const EigenSystem<2> solver = EigenSystemOf(Eigen::Matrix2d(covariance.topLeftCorner<2, 2>()));
    axes.col(0).head<2>() = solver.vectors.col(1);
    axes.col(0) = OrientAxis(axes.col(0), points, mean);
    axes.col(1) = axes.col(2).cross(axes.col(0));
    return axes;
  }
  const EigenSystem<3> solver = EigenSystemOf(covariance);
  axes.col(0) = OrientAxis(solver.vectors.col(2), points, mean);
  axes.col(1) = OrientAxis(solver.vectors.col(1), points, mean);
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

std::ptrdiff_t CountNear(const std::vector<Vector3d>& points, const Plane& plane, double distance) {
  return std::ranges::count_if(points,
                               [&](const Vector3d& p) { return std::abs(plane.Distance(p)) < distance; });
}

Plane LeastSquares(const std::vector<Vector3d>& points, const Plane& start, double distance) {
  const Moments moments = WeightedMoments(
      points, [&](const Vector3d& p) { return std::abs(start.Distance(p)) < distance ? 1.0 : 0.0; });
  const EigenSystem<3> solver = EigenSystemOf(moments.covariance);
  const Vector3d normal = solver.vectors.col(0);
  return {normal, normal.dot(moments.mean)};
}

using Clusters = std::vector<std::vector<std::size_t>>;

constexpr std::size_t kNeighbours = 8;
constexpr std::size_t kDenseNeighbours = 9;  // itself included
constexpr std::size_t kNoCluster = std::numeric_limits<std::size_t>::max();

// Adapts the points with the given indices to nanoflann.
struct View {
  const std::vector<Vector3d>& points;
  const std::vector<std::size_t>& indices;

  std::size_t kdtree_get_point_count() const { return indices.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[indices[i]][static_cast<Eigen::Index>(axis)];
  }
  bool kdtree_get_bbox(auto&) const { return false; }
};

using Tree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, View>, View, 3, std::size_t>;

// Pairs of an index and a squared distance. nanoflann 1.5 renamed the type: Debian 12 has 1.4, Debian 13
// has 1.7.
using Matches =
    std::remove_reference_t<decltype(nanoflann::RadiusResultSet<double, std::size_t>::m_indices_dists)>;

Matches Within(const Tree& tree, const Vector3d& point, double radius) {
  Matches matches;
  tree.radiusSearch(point.data(), radius * radius, matches, {});  // nearest first
  return matches;
}

double TypicalDistance(const Tree& tree, const View& view) {
  std::vector<double> squares;
  for (const std::size_t index : view.indices) {
    std::array<std::size_t, kNeighbours + 1> found{};
    std::array<double, kNeighbours + 1> square{};
    const std::size_t count =
        tree.knnSearch(view.points[index].data(), kNeighbours + 1, found.data(), square.data());
    squares.push_back(square[count - 1]);
  }
  return std::sqrt(UpperMedian(std::move(squares)));
}

// A cloud in a canonical frame that follows its similarities: computations in it commute with similarities of
// the cloud, and do not depend on the order of the points.
struct CanonicalCloud {
  Sim3d S_map_canonical;                // p_map = S * p_canonical
  std::vector<Eigen::Vector3d> points;  // canonical; sorted by their coordinates
  std::vector<std::size_t> source;      // index in the cloud of each of `points`
};

// Origin: a robust weighted mean; axes: principal axes with the signs of the third moments; unit: the root
// mean square distance from the origin with the same weights. `upright` keeps the z axis and only rotates
// about it. Throws InputError for fewer than 11 points, or if all points coincide.
CanonicalCloud ToCanonicalFrame(std::span<const Vector3d> cloud, bool upright) {
  constexpr std::size_t kMinPoints = 11;  // as many as parameters of a superquadric
  ThrowIf<InputError>(cloud.size() < kMinPoints, "{} points, expected at least {} to fit a superquadric",
                      cloud.size(), kMinPoints);
  const Vector3d mean = std::accumulate(cloud.begin(), cloud.end(), Vector3d(0.0, 0.0, 0.0)) /
                        static_cast<double>(cloud.size());
  double square = 0.0;
  double largest = 0.0;
  for (const Vector3d& p : cloud) {
    square += (p - mean).squaredNorm() / static_cast<double>(cloud.size());
    largest = std::max(largest, p.cwiseAbs().maxCoeff());
  }
  const double radius = std::sqrt(square);
  ThrowIf<InputError>(!(radius > 1e-12 * largest) || !std::isfinite(radius),
                      "the points of the cloud coincide, expected points on the surface of an object");
  const std::vector<Vector3d> normalized =
      ToVector(cloud, [&](const Vector3d& p) -> Vector3d { return (p - mean) / radius; });
  const Moments moments = WeightedMoments(normalized, [](const Vector3d& p) {
    const double square_distance = p.squaredNorm();
    return 1.0 / (1.0 + square_distance * square_distance);
  });
  const Matrix3d axes = PrincipalAxes(moments.covariance, normalized, moments.mean, upright);
  const double unit = std::sqrt(moments.covariance.trace());
  CanonicalCloud result;
  result.S_map_canonical = {radius * unit, Eigen::Quaterniond(axes).normalized(),
                            mean + radius * moments.mean};
  std::vector<Vector3d> points = ToVector(normalized, [&](const Vector3d& p) -> Vector3d {
    return axes.transpose() * (p - moments.mean) / unit;
  });
  result.source.resize(points.size());
  std::iota(result.source.begin(), result.source.end(), std::size_t{0});
  std::ranges::sort(result.source, [&](std::size_t a, std::size_t b) {
    return std::lexicographical_compare(points[a].begin(), points[a].end(), points[b].begin(),
                                        points[b].end());
  });
  for (const std::size_t index : result.source) {
    result.points.push_back(points[index]);
  }
  return result;
}

}  // namespace

std::optional<Plane> FindLargestPlane(const std::vector<Vector3d>& points, double distance, bool horizontal,
                                      std::uint64_t seed) {
  if (points.size() < 3) {
    return std::nullopt;
  }
  constexpr int kTrials = 1000;           // almost surely finds a plane with a fifth of the points
  constexpr double kLevelCosine = 0.966;  // 15 degrees
  std::mt19937_64 random(seed);
  std::uniform_int_distribution<std::size_t> pick(0, points.size() - 1);
  std::optional<Plane> best;
  std::ptrdiff_t most = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Vector3d& a = points[pick(random)];
    const Vector3d& b = points[pick(random)];
    const Vector3d& c = points[pick(random)];
    const Vector3d normal = (b - a).cross(c - a);
    const double length = normal.norm();
    if (length < 1e-9 || (horizontal && std::abs(normal.z()) < kLevelCosine * length)) {
      continue;
    }
    const Plane plane{normal / length, normal.dot(a) / length};
    const std::ptrdiff_t count = CountNear(points, plane, distance);
    if (count > most) {
      most = count;
      best = plane;
    }
  }
  for (int i = 0; best && i < 3; ++i) {
    best = LeastSquares(points, *best, distance);
  }
  return best;
}

Clusters ClusterPoints(const std::vector<Vector3d>& points, const std::vector<std::size_t>& indices,
                       double distance) {
  if (indices.empty()) {
    return {};
  }
  const View view{points, indices};
  const Tree tree(3, view, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  const double radius = distance * TypicalDistance(tree, view);
  const auto at = [&](std::size_t i) -> const Vector3d& { return points[indices[i]]; };
  std::vector<bool> dense(indices.size());
  for (std::size_t i = 0; i < indices.size(); ++i) {
    dense[i] = Within(tree, at(i), radius).size() >= kDenseNeighbours;
  }
  Clusters clusters;
  std::vector<std::size_t> cluster_of(indices.size(), kNoCluster);
  for (std::size_t first = 0; first < indices.size(); ++first) {
    if (!dense[first] || cluster_of[first] != kNoCluster) {
      continue;
    }
    std::vector<std::size_t> pending = {first};
    cluster_of[first] = clusters.size();
    while (!pending.empty()) {
      const std::size_t i = pending.back();
      pending.pop_back();
      for (const auto& [j, square] : Within(tree, at(i), radius)) {
        if (dense[j] && cluster_of[j] == kNoCluster) {
          cluster_of[j] = clusters.size();
          pending.push_back(j);
        }
      }
    }
    clusters.emplace_back();
  }
  for (std::size_t i = 0; i < indices.size(); ++i) {
    std::size_t cluster = cluster_of[i];
    if (!dense[i]) {
      const Matches matches = Within(tree, at(i), radius);
      const auto near = std::ranges::find_if(matches, [&](const auto& m) { return dense[m.first]; });
      cluster = near == matches.end() ? kNoCluster : cluster_of[near->first];
    }
    if (cluster != kNoCluster) {
      clusters[cluster].push_back(indices[i]);
    }
  }
  std::ranges::stable_sort(clusters, [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return clusters;
}

SuperquadricFit FitSuperquadric(std::span<const Vector3d> cloud, const FitOptions& options) {
  const CanonicalCloud canonical = ToCanonicalFrame(cloud, options.upright);
  const SearchResult found = SearchSuperquadric(Thinned(canonical.points, options.max_points), options);
  SuperquadricFit fit;
  fit.superquadric = canonical.S_map_canonical * found.superquadric;
  fit.noise = canonical.S_map_canonical.scale * found.model.sigma;
  fit.cost = found.cost;
  fit.points = static_cast<int>(cloud.size());
  fit.inlier.resize(cloud.size());
  const SurfaceDistance distance(found.superquadric.shape);
  const Rigid3d T_object_canonical = found.superquadric.T_map_object.Inverse();
  double squares = 0.0;
  int inliers = 0;
  for (std::size_t i = 0; i < canonical.points.size(); ++i) {
    const Vector3d p = T_object_canonical * canonical.points[i];
    if (found.model.InlierProbability(distance(p)) > 0.5) {
      const double radial = found.superquadric.shape.RadialDistance(p);
      squares += radial * radial;
      ++inliers;
      fit.inlier[canonical.source[i]] = true;
    }
  }
  fit.rms = canonical.S_map_canonical.scale * std::sqrt(squares / std::max(inliers, 1));
  fit.inlier_share = static_cast<double>(inliers) / static_cast<double>(cloud.size());
  return fit;
}

std::vector<SuperquadricFit> FitSuperquadrics(std::span<const Vector3d> cloud,
                                              const MultiFitOptions& options) {
  const CanonicalCloud canonical = ToCanonicalFrame(cloud, options.fit.upright);
  std::vector<std::size_t> kept(canonical.points.size());  // indices of canonical points
  std::iota(kept.begin(), kept.end(), std::size_t{0});
  if (options.remove_plane) {
    const std::optional<Plane> plane =
        FindLargestPlane(canonical.points, options.plane_distance, options.fit.upright, options.fit.seed);
    std::erase_if(kept, [&](std::size_t i) {
      return plane && std::abs(plane->Distance(canonical.points[i])) < options.plane_distance;
    });
  }
  std::vector<std::vector<std::size_t>> clusters = {kept};
  if (options.clusters != 1) {
    clusters = ClusterPoints(canonical.points, kept, options.cluster_distance);
    if (options.clusters > 0) {
      clusters.resize(std::min(clusters.size(), static_cast<std::size_t>(options.clusters)));
    }
    std::erase_if(clusters, [&](const auto& cluster) {
      return cluster.size() < static_cast<std::size_t>(options.min_cluster_points);
    });
  }
  ThrowIf<InputError>(clusters.empty(), "no cluster has {} points or more, expected at least one object",
                      options.min_cluster_points);
  std::vector<SuperquadricFit> fits;
  for (const std::vector<std::size_t>& cluster : clusters) {
    const std::vector<Vector3d> part =
        ToVector(cluster, [&](const std::size_t i) -> Vector3d { return cloud[canonical.source[i]]; });
    SuperquadricFit fit = FitSuperquadric(part, options.fit);
    std::vector<bool> inlier(cloud.size(), false);
    for (std::size_t k = 0; k < cluster.size(); ++k) {
      inlier[canonical.source[cluster[k]]] = fit.inlier[k];
    }
    fit.inlier = std::move(inlier);
    fits.push_back(std::move(fit));
  }
  return fits;
}

}  // namespace sqslam
