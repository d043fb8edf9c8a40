#include "slam/estimation/sim3_estimation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "slam/estimation/reprojection_error.h"
#include "slam/geometry/lie.h"
#include "slam/geometry/similarity_alignment.h"

namespace sqslam {
namespace {

constexpr std::size_t kSampleSize = 3;
// Standard deviation of the log distance of a map point. Two cameras at the same place see the same pixels at
// any scale, so only the distances constrain it.
constexpr double kDistanceSigma = 0.1;

struct MatchErrors {
  double image1 = 0.0;
  double image2 = 0.0;
  bool Fits() const { return image1 <= kChi2TwoDof99 && image2 <= kChi2TwoDof99; }
};

MatchErrors ErrorsOf(const Camera& camera, const Sim3d& S_1_2, const Sim3d& S_2_1, const Sim3Match& match) {
  return {SquaredError(camera, S_1_2 * match.p_camera2, match.pixel1, match.variance1),
          SquaredError(camera, S_2_1 * match.p_camera1, match.pixel2, match.variance2)};
}

// Log ratio of the distances of the match from camera 1 in the two maps, in standard deviations.
double DistanceError(const Sim3d& S_1_2, const Sim3Match& match) {
  return 0.5 * std::log((S_1_2 * match.p_camera2).squaredNorm() / match.p_camera1.squaredNorm()) /
         kDistanceSigma;
}

Sim3Estimate Evaluate(const Camera& camera, const std::vector<Sim3Match>& matches, const Sim3d& S_1_2) {
  const Sim3d S_2_1 = S_1_2.Inverse();
  Sim3Estimate evaluated{S_1_2, std::vector<bool>(matches.size()), 0, 0.0};
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const MatchErrors errors = ErrorsOf(camera, S_1_2, S_2_1, matches[i]);
    evaluated.inliers[i] = errors.Fits();
    evaluated.num_inliers += errors.Fits() ? 1 : 0;
    evaluated.cost += errors.Fits() ? errors.image1 + errors.image2 : 2.0 * kChi2TwoDof99;
  }
  return evaluated;
}

std::optional<Sim3d> AlignTriple(const std::vector<Sim3Match>& matches,
                                 const std::array<std::size_t, kSampleSize>& triple) {
  std::vector<Eigen::Vector3d> source;
  std::vector<Eigen::Vector3d> target;
  for (const std::size_t i : triple) {
    source.push_back(matches[i].p_camera2);
    target.push_back(matches[i].p_camera1);
  }
  return AlignSimilarity(source, target);
}

// Returns the number of samples after which one probably has no outliers.
double DrawsNeeded(int inliers, std::size_t matches) {
  constexpr double kConfidence = 0.99;
  const double share = static_cast<double>(inliers) / static_cast<double>(matches);
  const double triple = share * share * share;
  return triple >= 1.0   ? 1.0
         : triple <= 0.0 ? std::numeric_limits<double>::infinity()
                         : std::log(1.0 - kConfidence) / std::log1p(-triple);
}

// Draws three different indices below `count`.
std::array<std::size_t, kSampleSize> DrawTriple(std::size_t count, std::mt19937_64& random) {
  std::uniform_int_distribution<std::size_t> index(0, count - 1);
  std::array<std::size_t, kSampleSize> drawn{};
  for (std::size_t i = 0; i < kSampleSize;) {
    drawn[i] = index(random);
    const auto end = drawn.begin() + i;
    i += std::find(drawn.begin(), end, drawn[i]) == end ? 1 : 0;
  }
  return drawn;
}

// Huber loss of a squared error, and its weight for the residual.
double Loss(double squared, bool robust) {
  return robust && squared > kChi2TwoDof99 ? 2.0 * std::sqrt(kChi2TwoDof99 * squared) - kChi2TwoDof99
                                           : squared;
}
double Weight(double squared, bool robust) {
  return robust && squared > kChi2TwoDof99 ? std::sqrt(kChi2TwoDof99 / squared) : 1.0;
}

using ImageRows = Eigen::Matrix<double, 2, 7>;

struct Sim3Equations {
  Matrix7d hessian = Matrix7d::Zero();
  Vector7d gradient = Vector7d::Zero();

  void Add(const ImageRows& jacobian, const Eigen::Vector2d& residual, double weight) {
    hessian.noalias() += weight * jacobian.transpose() * jacobian;
    gradient.noalias() += weight * jacobian.transpose() * residual;
  }

  // log |p| for p' = Exp(x) p changes by [0, p / |p|^2, 1] x.
  void AddDistance(const Eigen::Vector3d& p, double error) {
    Vector7d jacobian;
    jacobian << Eigen::Vector3d::Zero(), p / p.squaredNorm(), 1.0;
    jacobian /= kDistanceSigma;
    const double weight = Weight(error * error, true);
    hessian.noalias() += weight * jacobian * jacobian.transpose();
    gradient += weight * error * jacobian;
  }
};

// Infinite if a point in use is behind a camera.
double Cost(const Camera& camera, const std::vector<Sim3Match>& matches, const std::vector<bool>& use,
            const Sim3d& S_1_2, bool robust) {
  const Sim3d S_2_1 = S_1_2.Inverse();
  double cost = 0.0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (use[i]) {
      const MatchErrors errors = ErrorsOf(camera, S_1_2, S_2_1, matches[i]);
      const double distance = DistanceError(S_1_2, matches[i]);
      cost += Loss(errors.image1, robust) + Loss(errors.image2, robust) + Loss(distance * distance, true);
    }
  }
  return cost;
}

Sim3Equations Linearize(const Camera& camera, const std::vector<Sim3Match>& matches,
                        const std::vector<bool>& use, const Sim3d& S_1_2, bool robust) {
  Sim3Equations equations;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (use[i]) {
      const Sim3Match& match = matches[i];
      const Sim3Linearization at = LinearizeSim3(camera, S_1_2, match);
      const Eigen::Vector2d e1 = at.residual.head<2>();
      const Eigen::Vector2d e2 = at.residual.tail<2>();
      equations.Add(at.jacobian.topRows<2>(), e1,
                    Weight(e1.squaredNorm() / match.variance1, robust) / match.variance1);
      equations.Add(at.jacobian.bottomRows<2>(), e2,
                    Weight(e2.squaredNorm() / match.variance2, robust) / match.variance2);
      equations.AddDistance(S_1_2 * match.p_camera2, DistanceError(S_1_2, match));
    }
  }
  return equations;
}

// Levenberg-Marquardt. Returns false if the normal equations have no solution.
bool Minimize(const Camera& camera, const std::vector<Sim3Match>& matches, const std::vector<bool>& use,
              bool robust, Sim3d& S_1_2) {
  constexpr int kIterations = 20;
  constexpr double kMinCostChange = 1e-9;  // relative fall of the cost
  double damping = 1e-6;
  double cost = Cost(camera, matches, use, S_1_2, robust);
  Sim3Equations equations = Linearize(camera, matches, use, S_1_2, robust);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Matrix7d damped = equations.hessian;
    damped.diagonal() *= 1.0 + damping;
    const Eigen::LDLT<Matrix7d> solver(damped);
    const Vector7d step = solver.solve(-equations.gradient);
    if (!solver.isPositive() || !step.allFinite()) {
      return false;
    }
    const Sim3d moved = ExpSim3(step) * S_1_2;
    const double moved_cost = Cost(camera, matches, use, moved, robust);
    if (!(moved_cost <= cost)) {
      damping *= 10.0;
      continue;
    }
    const bool converged = cost - moved_cost <= kMinCostChange * cost;
    S_1_2 = moved;
    cost = moved_cost;
    if (converged) {
      break;
    }
    damping = std::max(1e-9, 0.1 * damping);
    equations = Linearize(camera, matches, use, S_1_2, robust);
  }
  return true;
}

// Refines by the matches that `fits(index, errors)` accepts. Returns false if they do not determine a
// similarity.
bool Improve(const Camera& camera, const std::vector<Sim3Match>& matches, bool robust, Sim3d& S,
             auto&& fits) {
  const Sim3d S_inverse = S.Inverse();
  std::vector<bool> use(matches.size());
  for (std::size_t i = 0; i < matches.size(); ++i) {
    use[i] = fits(i, ErrorsOf(camera, S, S_inverse, matches[i]));
  }
  return std::ranges::count(use, true) >= 3 && Minimize(camera, matches, use, robust, S);
}

// Local optimisation of a hypothesis (Chum, Matas, Kittler, "Locally Optimized RANSAC", 2003): refines it by
// the reprojection errors of its loose inliers while the cost decreases.
void Polish(const Camera& camera, const std::vector<Sim3Match>& matches, Sim3Estimate& best) {
  constexpr int kRounds = 5;
  constexpr double kMaxError = 4.0 * kChi2TwoDof99;  // squared, of a loose inlier
  for (int round = 0; round < kRounds; ++round) {
    Sim3d S = best.S_camera1_camera2;
    const bool improved = Improve(camera, matches, true, S, [](std::size_t, const MatchErrors& errors) {
      return std::max(errors.image1, errors.image2) <= kMaxError;
    });
    if (!improved) {
      return;
    }
    Sim3Estimate next = Evaluate(camera, matches, S);
    if (next.cost >= best.cost) {
      return;
    }
    best = std::move(next);
  }
}

}  // namespace

std::optional<Sim3Estimate> EstimateSim3(const Camera& camera, const std::vector<Sim3Match>& matches) {
  constexpr int kMaxDraws = 300;
  if (matches.size() < std::size_t{kMinSim3Inliers}) {
    return std::nullopt;
  }
  std::mt19937_64 random(1);
  Sim3Estimate best;
  best.cost = std::numeric_limits<double>::infinity();
  double needed = kMaxDraws;
  for (int i = 0; i < kMaxDraws && i < needed; ++i) {
    const std::optional<Sim3d> S = AlignTriple(matches, DrawTriple(matches.size(), random));
    if (!S) {
      continue;  // the points are collinear
    }
    Sim3Estimate candidate = Evaluate(camera, matches, *S);
    if (candidate.cost < best.cost) {
      best = std::move(candidate);
      Polish(camera, matches, best);
      needed = DrawsNeeded(best.num_inliers, matches.size());
    }
  }
  if (best.num_inliers < kMinSim3Inliers) {
    return std::nullopt;
  }
  return best;
}

int RefineSim3(const Camera& camera, const std::vector<Sim3Match>& matches, Sim3d& S_camera1_camera2,
               std::vector<bool>& inliers) {
  constexpr int kRounds = 3;
  inliers.resize(matches.size(), inliers.empty());
  int count = 0;
  Sim3d S = S_camera1_camera2;
  for (int round = 0; round < kRounds; ++round) {
    const bool improved =
        Improve(camera, matches, round == 0, S, [&](std::size_t i, const MatchErrors& errors) {
          return inliers[i] && std::isfinite(errors.image1 + errors.image2);
        });
    if (!improved) {
      return 0;
    }
    Sim3Estimate evaluated = Evaluate(camera, matches, S);
    inliers = std::move(evaluated.inliers);
    count = evaluated.num_inliers;
  }
  S_camera1_camera2 = S;
  return count;
}

Sim3Linearization LinearizeSim3(const Camera& camera, const Sim3d& S_camera1_camera2,
                                const Sim3Match& match) {
  const Sim3d S_2_1 = S_camera1_camera2.Inverse();
  const Eigen::Vector3d p1 = S_camera1_camera2 * match.p_camera2;
  const Eigen::Vector3d p2 = S_2_1 * match.p_camera1;
  // Derivative of Exp(x) p by x: [-Skew(p), I, p].
  const auto moved = [](const Eigen::Vector3d& p) {
    Eigen::Matrix<double, 3, 7> J;
    J << -Skew(p), Eigen::Matrix3d::Identity(), p;
    return J;
  };
  Sim3Linearization at;
  at.residual << camera.Project(p1) - match.pixel1, camera.Project(p2) - match.pixel2;
  at.jacobian.topRows<2>() = ProjectionJacobian(camera, p1) * moved(p1);
  at.jacobian.bottomRows<2>() = -ProjectionJacobian(camera, p2) *
                                (S_2_1.scale * S_2_1.rotation.toRotationMatrix()) * moved(match.p_camera1);
  return at;
}

}  // namespace sqslam
