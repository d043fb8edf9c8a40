#include "slam/objects/yaw.h"

#include <ceres/ceres.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace sqslam {
namespace {

constexpr double kPi = std::numbers::pi;

// A line in normalised image coordinates of a level camera: all that the residual needs.
struct NormalisedLine {
  Eigen::Matrix3d R_camera_map = Eigen::Matrix3d::Identity();
  Eigen::Vector2d midpoint = Eigen::Vector2d::Zero();
  Eigen::Vector2d direction = Eigen::Vector2d::Zero();  // unit
  double length = 0.0;                                  // px
};

// Sine of the angle between the line and the image of the map direction (cos yaw, sin yaw, 0).
template <typename T>
T SineToAxis(const NormalisedLine& line, const T& yaw) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const Eigen::Matrix3d& R = line.R_camera_map;
  const T c = cos(yaw);
  const T s = sin(yaw);
  const T z = R(2, 0) * c + R(2, 1) * s;
  const T x = R(0, 0) * c + R(0, 1) * s - z * line.midpoint.x();
  const T y = R(1, 0) * c + R(1, 1) * s - z * line.midpoint.y();
  return (x * line.direction.y() - y * line.direction.x()) / sqrt(x * x + y * y + 1e-12);
}

double SineToVertical(const NormalisedLine& line) {
  const Eigen::Vector3d axis = line.R_camera_map.col(2);
  const Eigen::Vector2d d = axis.head<2>() - axis.z() * line.midpoint;
  return (d.x() * line.direction.y() - d.y() * line.direction.x()) / std::max(d.norm(), 1e-12);
}

struct AxisCost {
  const NormalisedLine* line;
  double offset;  // 0: the x axis, pi/2: the y axis

  template <typename T>
  bool operator()(const T* yaw, T* residual) const {
    residual[0] = SineToAxis(*line, T(yaw[0] + offset));
    return true;
  }
};

std::vector<NormalisedLine> Normalise(std::span<const LineView> views, const Camera& camera) {
  std::vector<NormalisedLine> lines;
  for (const LineView& view : views) {
    const Eigen::Matrix3d R_camera_map = view.T_map_camera.RotationMatrix().transpose();
    for (const LineSegment& segment : view.lines) {
      const Eigen::Vector2d a = camera.Unproject(segment.a).head<2>();
      const Eigen::Vector2d b = camera.Unproject(segment.b).head<2>();
      if ((b - a).norm() > 1e-9) {
        lines.push_back({R_camera_map, 0.5 * (a + b), (b - a).normalized(), segment.Length()});
      }
    }
  }
  return lines;
}

struct Match {
  int line = 0;
  double offset = 0.0;
};

// Lines that agree with the horizontal axes at this yaw; those nearer to the vertical axis are left out, as
// they say nothing about yaw.
std::vector<Match> MatchLines(const std::vector<NormalisedLine>& lines, double yaw, double max_sine,
                              double& score) {
  std::vector<Match> matches;
  score = 0.0;
  for (int i = 0; i < static_cast<int>(lines.size()); ++i) {
    const double x = std::abs(SineToAxis(lines[i], yaw));
    const double y = std::abs(SineToAxis(lines[i], yaw + kPi / 2.0));
    const double best = std::min(x, y);
    if (best < max_sine && best <= std::abs(SineToVertical(lines[i]))) {
      matches.push_back({i, x <= y ? 0.0 : kPi / 2.0});
      score += lines[i].length * (1.0 - 0.5 * best / max_sine);
    }
  }
  return matches;
}

double RefineYaw(const std::vector<NormalisedLine>& lines, const std::vector<Match>& matches, double start) {
  double yaw = start;
  ceres::Problem problem;
  for (const Match& match : matches) {
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<AxisCost, 1, 1>(new AxisCost{&lines[match.line], match.offset}),
        new ceres::ScaledLoss(new ceres::CauchyLoss(0.03), lines[match.line].length, ceres::TAKE_OWNERSHIP),
        &yaw);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 10;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return yaw;
}

}  // namespace

double WrapQuarter(double yaw) {
  const double wrapped = std::remainder(yaw, kPi / 2.0);
  return wrapped >= kPi / 4.0 ? wrapped - kPi / 2.0 : wrapped;
}

std::optional<YawEstimate> YawFromLines(std::span<const LineView> views, const Camera& camera,
                                        const YawOptions& options) {
  const std::vector<NormalisedLine> lines = Normalise(views, camera);
  if (static_cast<int>(lines.size()) < options.min_lines) {
    return std::nullopt;
  }
  const double max_sine = std::sin(options.match_angle_deg * kPi / 180.0);
  double total = 0.0;
  for (const NormalisedLine& line : lines) {
    total += line.length;
  }
  double best_score = 0.0;
  double best_yaw = 0.0;
  std::vector<Match> best_matches;
  for (int i = 0; i < options.samples; ++i) {
    const double yaw = -kPi / 4.0 + (i + 0.5) * (kPi / 2.0) / options.samples;
    double score = 0.0;
    std::vector<Match> matches = MatchLines(lines, yaw, max_sine, score);
    if (score > best_score) {
      best_score = score;
      best_yaw = yaw;
      best_matches = std::move(matches);
    }
  }
  if (static_cast<int>(best_matches.size()) < std::max(1, options.min_lines - 1)) {
    return std::nullopt;
  }
  const double refined = RefineYaw(lines, best_matches, best_yaw);
  const bool accepted = std::abs(refined - best_yaw) <= options.max_refinement_deg * kPi / 180.0;
  return YawEstimate{WrapQuarter(accepted ? refined : best_yaw), best_score / total};
}

std::optional<YawEstimate> YawFromPoints(std::span<const Eigen::Vector3d> points, const YawOptions& options) {
  if (static_cast<int>(points.size()) < options.pca_min_points) {
    return std::nullopt;
  }
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3d& p : points) {
    mean += p.head<2>();
  }
  mean /= static_cast<double>(points.size());
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector2d d = p.head<2>() - mean;
    covariance += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance);  // eigenvalues ascending
  const double small = std::max(solver.eigenvalues()[0], 1e-12);
  const double ratio = solver.eigenvalues()[1] / small;
  if (ratio < options.pca_min_ratio) {
    return std::nullopt;
  }
  const Eigen::Vector2d axis = solver.eigenvectors().col(1);
  return YawEstimate{WrapQuarter(std::atan2(axis.y(), axis.x())), 1.0 - 1.0 / ratio};
}

void YawMean::Add(const YawEstimate& estimate) {
  sum_ += std::polar(estimate.quality, 4.0 * estimate.yaw);
  weight_ += estimate.quality;
}

}  // namespace sqslam
