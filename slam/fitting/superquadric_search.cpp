#include "slam/fitting/superquadric_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "slam/fitting/surface_measures.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

constexpr double kPi = std::numbers::pi;

// Share of log(area) that each point adds to the cost, which constrains unobserved sides. 1 would be the
// likelihood of points spread evenly over the whole surface, but makes half-seen objects too small.
constexpr double kSearchAreaWeight = 0.3;
constexpr double kFinalAreaWeight = 0.2;

constexpr int kStartRotations = 24;    // spread over those that differ for a box
constexpr int kSearchPoints = 160;     // that the search over starts uses
constexpr std::size_t kFinalists = 6;  // candidates that are refined with all points

// Returns a rotation that maps the axes (x, y, z) to (y, z, x), applied `times` times.
Quaterniond Cycle(int times) {
  return Quaterniond(Eigen::AngleAxisd(times * 2.0 * kPi / 3.0, Vector3d::Ones().normalized()));
}

std::vector<Quaterniond> CubeRotations() {
  std::vector<Quaterniond> rotations;
  const Quaterniond flip(Eigen::AngleAxisd(kPi, Vector3d(1.0, 0.0, 0.0)));
  for (int axis = 0; axis < 3; ++axis) {
    for (int turn = 0; turn < 4; ++turn) {
      const Quaterniond quarter(Eigen::AngleAxisd(0.5 * kPi * turn, Vector3d::UnitZ()));
      rotations.push_back(Cycle(axis) * quarter);
      rotations.push_back(Cycle(axis) * flip * quarter);
    }
  }
  return rotations;
}

// Returns start orientations for boxes, whose three axes may be swapped: `count` rotations spread evenly over
// SO(3) modulo the 24 rotations of a cube (upright: over a quarter turn about the z axis).
std::vector<Quaterniond> SpreadRotations(int count, bool upright, std::uint64_t seed) {
  std::vector<Quaterniond> chosen;
  if (upright) {
    for (int i = 0; i < count; ++i) {
      chosen.emplace_back(Eigen::AngleAxisd(0.5 * kPi * i / count, Vector3d::UnitZ()));
    }
    return chosen;
  }
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const std::vector<Quaterniond> symmetries = CubeRotations();
  std::vector<Quaterniond> pool = {Quaterniond::Identity()};
  for (int i = 0; i < 40 * count; ++i) {
    pool.emplace_back(
        Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized());
  }
  std::vector<double> nearest(pool.size(), -1.0);  // cosine of half the angle to the nearest chosen one
  std::size_t next = 0;                            // farthest from all chosen ones
  while (static_cast<int>(chosen.size()) < count) {
    chosen.push_back(pool[next]);
    for (const Quaterniond& symmetry : symmetries) {
      const Quaterniond same = chosen.back() * symmetry;
      for (std::size_t i = 0; i < pool.size(); ++i) {
        nearest[i] = std::max(nearest[i], std::abs(pool[i].dot(same)));
      }
    }
    next = static_cast<std::size_t>(std::ranges::min_element(nearest) - nearest.begin());
  }
  return chosen;
}

// Returns other parametrisations of nearly the same solid, with which a fit escapes a local minimum (the
// "switching" of Liu et al., Robust and Accurate Superquadric Recovery, CVPR 2022): the axis of e1 swapped,
// and square sections rotated by 45 degrees, where e becomes 2 - e.
std::vector<PosedSuperquadric> SimilarShapes(const PosedSuperquadric& superquadric, bool upright) {
  std::vector<PosedSuperquadric> similar;
  const Superquadric& shape = superquadric.shape;
  if (!upright) {
    for (int times = 1; times < 3; ++times) {
      PosedSuperquadric other = superquadric;
      const Quaterniond cycle = Cycle(times);
      other.T_map_object.rotation = superquadric.T_map_object.rotation * cycle;
      other.shape.half_size = (cycle.conjugate() * shape.half_size).cwiseAbs();
      for (const auto& [e1, e2] : {std::array{shape.e1, shape.e2}, std::array{shape.e2, shape.e1},
                                   std::array{shape.e1, shape.e1}, std::array{shape.e2, shape.e2}}) {
        other.shape.e1 = e1;
        other.shape.e2 = e2;
        similar.push_back(other);
      }
    }
  }
  const std::size_t unturned = similar.size();
  similar.push_back(superquadric);
  for (std::size_t i = 0; i <= unturned; ++i) {
    PosedSuperquadric turned = similar[i];
    const Quaterniond eighth(Eigen::AngleAxisd(0.25 * kPi, Vector3d::UnitZ()));
    turned.T_map_object.rotation = turned.T_map_object.rotation * eighth;
    const Vector3d half = turned.shape.half_size;
    const double e = turned.shape.e2;
    // Keeps the corner of the section, on the diagonal: |x| = |y| = a 2^(-e/2).
    const double reach = std::sqrt(half.x() * half.y()) * std::pow(2.0, 0.5 - 0.5 * e);
    turned.shape.half_size = {reach, reach, half.z()};
    turned.shape.e2 = 2.0 - e;
    similar.push_back(turned);
  }
  similar.erase(similar.begin() + unturned);
  return similar;
}

Points EvenSubset(const Points& points, int count) {
  if (static_cast<int>(points.size()) <= count) {
    return points;
  }
  Points subset;
  for (int i = 0; i < count; ++i) {
    subset.push_back(points[(2 * static_cast<std::size_t>(i) + 1) * points.size() / (2 * count)]);
  }
  return subset;
}

// Returns the box with the given axes that holds most of the points.
PosedSuperquadric BoxStart(const Points& points, const Quaterniond& rotation, double outlier_share) {
  const Matrix3d axes = rotation.toRotationMatrix().transpose();
  Vector3d center;
  Vector3d half;
  std::vector<double> values(points.size());
  const auto cut = static_cast<std::size_t>(0.25 * outlier_share * static_cast<double>(points.size()));
  for (int axis = 0; axis < 3; ++axis) {
    std::ranges::transform(points, values.begin(), [&](const Vector3d& p) { return axes.row(axis).dot(p); });
    std::ranges::sort(values);
    const double low = values[cut];
    const double high = values[values.size() - 1 - cut];
    center[axis] = 0.5 * (low + high);
    half[axis] = std::max(0.5 * (high - low), 0.02);
  }
  return {{half, 1.0, 1.0}, {rotation, rotation * center}};
}

using Candidates = std::vector<SearchResult>;

void KeepBest(Candidates& candidates, std::size_t count) {
  std::ranges::stable_sort(candidates, {}, &SearchResult::cost);
  candidates.resize(std::min(candidates.size(), count));
}

Candidates Starts(const Points& points, const FitOptions& options, const MixtureModel& model) {
  constexpr std::array<std::array<double, 2>, 7> kShapes = {
      {{0.4, 0.4}, {0.4, 1.0}, {1.0, 0.4}, {1.0, 1.0}, {1.6, 1.0}, {1.0, 1.6}, {1.6, 1.6}}};
  Candidates starts;
  std::vector<Quaterniond> rotations = SpreadRotations(kStartRotations, options.upright, options.seed);
  rotations.insert(rotations.begin(), Quaterniond::Identity());
  for (const Quaterniond& rotation : rotations) {
    for (int axis = 0; axis < (options.upright ? 1 : 3); ++axis) {
      const PosedSuperquadric box = BoxStart(points, rotation * Cycle(axis), options.outlier_share);
      for (const auto& [e1, e2] : kShapes) {
        PosedSuperquadric start = box;
        start.shape.e1 = e1;
        start.shape.e2 = e2;
        starts.push_back({start, model, MixtureCost(points, start, model)});
      }
    }
  }
  return starts;
}

void Refine(Candidates& candidates, const Points& points, const MixtureModel& model,
            const MixtureFitOptions& options) {
  for (SearchResult& candidate : candidates) {
    const MixtureFit fit = FitMixture(points, candidate.superquadric, model, options);
    candidate = {fit.superquadric, model, fit.cost};
  }
}

double VisibleArea(const Superquadric& shape) {
  return 0.5 * std::exp(LogSurfaceArea(shape.half_size, shape.e1, shape.e2));
}

// Estimates the noise and the share of outliers that suit a shape best, and the likelihood of the points:
// spread evenly over the visible half of the surface, with outliers in the bounding box of all points.
class Likelihood {
 public:
  Likelihood(const Points& points, double noise_floor, double area_weight)
      : points_(points), noise_floor_(noise_floor), area_weight_(area_weight) {
    Eigen::AlignedBox3d box;
    for (const Vector3d& p : points) {
      box.extend(p);
    }
    volume_ = std::max(box.volume(), 1e-3);
  }

  MixtureModel Model(const PosedSuperquadric& superquadric, MixtureModel model) const {
    const double area = VisibleArea(superquadric.shape);
    const std::vector<double> distances = Distances(superquadric);
    for (int iteration = 0; iteration < 5; ++iteration) {
      double sum = 0.0;
      double squares = 0.0;
      for (const double d : distances) {
        const double inlier = model.InlierProbability(d);
        sum += inlier;
        squares += inlier * d * d;
      }
      const double share = std::clamp(sum / static_cast<double>(distances.size()), 0.2, 0.995);
      model.sigma = std::clamp(std::sqrt(squares / std::max(sum, 1.0)), noise_floor_, 0.1);
      model.outlier_ratio = (1.0 - share) / share * std::sqrt(2.0 * kPi) * model.sigma * area / volume_;
    }
    return model;
  }

  // For MixtureFitOptions: area_weight times the expected number of points on the surface.
  double AreaWeight(const PosedSuperquadric& superquadric, const MixtureModel& model) const {
    double sum = 0.0;
    for (const double d : Distances(superquadric)) {
      sum += model.InlierProbability(d);
    }
    return area_weight_ * sum;
  }

  // Negative log likelihood.
  double Cost(const PosedSuperquadric& superquadric, const MixtureModel& model) const {
    const double area = VisibleArea(superquadric.shape);
    const double ratio = std::sqrt(2.0 * kPi) * model.sigma * area / volume_;
    const double share = ratio / (ratio + model.outlier_ratio);
    double sum = 0.0;
    for (const double d : Distances(superquadric)) {
      sum += model.Cost(d);
    }
    const double log_peak = std::log(share / (std::sqrt(2.0 * kPi) * model.sigma * area));
    return sum - static_cast<double>(points_.size()) * (log_peak + std::log1p(model.outlier_ratio));
  }

 private:
  std::vector<double> Distances(const PosedSuperquadric& superquadric) const {
    const SurfaceDistance distance(superquadric.shape);
    const Rigid3d T_object_map = superquadric.T_map_object.Inverse();
    return ToVector(points_, [&](const Vector3d& p) { return distance(T_object_map * p); });
  }

  const Points& points_;
  double noise_floor_;
  double area_weight_;
  double volume_;
};

void RefineWithNoise(SearchResult& candidate, const Points& points, const Likelihood& likelihood, int rounds,
                     MixtureFitOptions options) {
  for (int round = 0; round < rounds; ++round) {
    candidate.model = likelihood.Model(candidate.superquadric, candidate.model);
    options.area_weight = likelihood.AreaWeight(candidate.superquadric, candidate.model);
    candidate.superquadric =
        FitMixture(points, candidate.superquadric, candidate.model, options).superquadric;
  }
  candidate.cost = likelihood.Cost(candidate.superquadric, candidate.model);
}

// Returns, of the eight parametrisations of the same solid (half turns about its axes, x and y swapped), the
// one with a_x >= a_y and the smallest rotation. Starts that converge to one optimum reach it in different
// parametrisations, and rounding decides which is best.
PosedSuperquadric UniqueDescription(PosedSuperquadric superquadric) {
  Vector3d& half = superquadric.shape.half_size;
  Quaterniond& rotation = superquadric.T_map_object.rotation;
  if (half.x() < half.y()) {
    std::swap(half.x(), half.y());
    rotation = rotation * Quaterniond(Eigen::AngleAxisd(0.5 * kPi, Vector3d::UnitZ()));
  }
  Quaterniond least = rotation;
  for (int axis = 0; axis < 3; ++axis) {
    const Quaterniond turned = rotation * Quaterniond(Eigen::AngleAxisd(kPi, Vector3d::Unit(axis)));
    if (std::abs(turned.w()) > std::abs(least.w())) {
      least = turned;
    }
  }
  rotation = least.normalized();
  return superquadric;
}

}  // namespace

SearchResult SearchSuperquadric(const Points& points, const FitOptions& options) {
  MixtureFitOptions fit;
  fit.upright = options.upright;
  const Points few = EvenSubset(points, kSearchPoints);
  Candidates candidates = Starts(few, options, {0.1, 0.03});
  KeepBest(candidates, candidates.size() / 3);
  fit.area_weight = kSearchAreaWeight * (1.0 - options.outlier_share) * static_cast<double>(few.size());
  fit.max_iterations = 8;
  fit.parameter_tolerance = 1e-2;
  Refine(candidates, few, {0.08, 0.03}, fit);
  KeepBest(candidates, std::max<std::size_t>(candidates.size() / 5, 10));
  fit.max_iterations = 12;
  Refine(candidates, few, {0.04, 0.02}, fit);
  KeepBest(candidates, kFinalists);

  const Likelihood likelihood(points, options.noise_floor, kSearchAreaWeight);
  fit.max_iterations = 10;
  fit.parameter_tolerance = 1e-4;
  for (SearchResult& candidate : candidates) {
    RefineWithNoise(candidate, points, likelihood, 2, fit);
  }
  KeepBest(candidates, candidates.size());
  SearchResult best = candidates.front();
  for (const PosedSuperquadric& similar : SimilarShapes(best.superquadric, options.upright)) {
    SearchResult candidate = {similar, {0.05, 0.03}, 0.0};
    candidate.superquadric = FitMixture(few, similar, {0.05, 0.03}, fit).superquadric;
    RefineWithNoise(candidate, points, likelihood, 2, fit);
    if (candidate.cost < best.cost) {
      best = candidate;
    }
  }
  fit.max_iterations = 50;
  fit.parameter_tolerance = 1e-10;
  RefineWithNoise(best, points, Likelihood(points, options.noise_floor, kFinalAreaWeight), 10, fit);
  best.superquadric = UniqueDescription(best.superquadric);
  return best;
}

}  // namespace sqslam
