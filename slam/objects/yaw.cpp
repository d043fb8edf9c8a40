#include "slam/objects/yaw.h"

#include <ceres/tiny_solver.h>
#include <ceres/tiny_solver_autodiff_function.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "slam/geometry/eigen_system.h"
#include "slam/objects/object_terms.h"

namespace sqslam {
namespace {

constexpr double kPi = std::numbers::pi;

// A line in normalised image coordinates, as far as the yaw is concerned: the image of the map direction (cos
// yaw, sin yaw, 0) at the line's midpoint (or where the axes are projected) is `image` * (cos yaw, sin yaw),
// not normalised.
struct NormalisedLine {
  Eigen::Matrix2d image = Eigen::Matrix2d::Zero();
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();  // unit
  double sine_to_vertical = 0.0;
  double weight = 0.0;
};

// Sine of the angle between the line and the image of the map direction (axis.x, axis.y, 0).
double SineToAxis(const NormalisedLine& line, const Eigen::Vector2d& axis) {
  const Eigen::Vector2d d = line.image * axis;
  return d.dot(line.normal) / std::sqrt(d.squaredNorm() + 1e-12);
}

Eigen::Vector2d AxisAt(double yaw) { return {std::cos(yaw), std::sin(yaw)}; }

std::vector<NormalisedLine> Normalise(std::span<const LineView> views, const Camera& camera, LineFit fit) {
  std::vector<NormalisedLine> lines;
  for (const LineView& view : views) {
    const Eigen::Matrix3d R_camera_map = view.T_map_camera.RotationMatrix().transpose();
    std::optional<Eigen::Vector2d> axes;
    if (view.p_axes) {
      axes = (view.T_map_camera.Inverse() * *view.p_axes).hnormalized();
    }
    for (const LineSegment& segment : view.lines) {
      const Eigen::Vector2d a = camera.Unproject(segment.a).head<2>();
      const Eigen::Vector2d b = camera.Unproject(segment.b).head<2>();
      if ((b - a).norm() <= 1e-9) {
        continue;
      }
      const Eigen::Matrix<double, 2, 3> image =
          R_camera_map.topRows<2>() - axes.value_or(0.5 * (a + b)) * R_camera_map.row(2);
      const Eigen::Vector2d direction = (b - a).normalized();
      const Eigen::Vector2d normal(direction.y(), -direction.x());
      const double to_vertical = image.col(2).dot(normal) / std::max(image.col(2).norm(), 1e-12);
      const double weight = fit == LineFit::kLeastSquares ? 1.0 : segment.Length();
      lines.push_back({image.leftCols<2>(), normal, to_vertical, weight});
    }
  }
  return lines;
}

struct Match {
  int line = 0;
  double offset = 0.0;  // of the axis from the yaw: 0 the x axis, pi/2 the y axis
};

// Finds the lines that agree with the horizontal axes at this yaw, except those nearer to the vertical axis,
// which do not constrain the yaw.
void MatchLines(const std::vector<NormalisedLine>& lines, double yaw, double max_sine, LineFit fit,
                std::vector<Match>& matches, double& score) {
  const Eigen::Vector2d x_axis = AxisAt(yaw);
  const Eigen::Vector2d y_axis(-x_axis.y(), x_axis.x());
  matches.clear();
  score = 0.0;
  for (int i = 0; i < static_cast<int>(lines.size()); ++i) {
    const double x = std::abs(SineToAxis(lines[i], x_axis));
    const double y = std::abs(SineToAxis(lines[i], y_axis));
    const double best = std::min(x, y);
    if (best < max_sine && best <= std::abs(lines[i].sine_to_vertical)) {
      matches.push_back({i, x <= y ? 0.0 : kPi / 2.0});
      score += lines[i].weight * (fit == LineFit::kLeastSquares ? 1.0 : 1.0 - 0.5 * best / max_sine);
    }
  }
}

// Residuals of the matched lines for ceres::TinySolver: half the sum of squares is the sum of Cauchy losses
// of their sines, weighted by the lines' lengths; of kLeastSquares the residuals are the angles.
struct YawProblem {
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 1 };

  const std::vector<NormalisedLine>* lines;
  const std::vector<Match>* matches;
  LineFit fit = LineFit::kRobust;

  int NumResiduals() const { return static_cast<int>(matches->size()); }

  template <typename T>
  bool operator()(const T* yaw, T* residuals) const {
    using std::asin, std::cos, std::sin, std::sqrt;
    constexpr double kWidth = 0.03;
    for (const Match& match : *matches) {
      const NormalisedLine& line = (*lines)[match.line];
      const T angle = *yaw + match.offset;
      const Eigen::Matrix<T, 2, 1> d = line.image.cast<T>() * Eigen::Matrix<T, 2, 1>(cos(angle), sin(angle));
      const T sine =
          (d.x() * line.normal.x() + d.y() * line.normal.y()) / sqrt(d.x() * d.x() + d.y() * d.y() + 1e-12);
      *residuals++ = fit == LineFit::kLeastSquares ? T(asin(sine)) : Robust(sine, kWidth, line.weight);
    }
    return true;
  }
};

double RefineYaw(const std::vector<NormalisedLine>& lines, const std::vector<Match>& matches, double start,
                 LineFit fit) {
  Eigen::Matrix<double, 1, 1> yaw(start);
  const YawProblem problem{&lines, &matches, fit};
  using Derived = ceres::TinySolverAutoDiffFunction<YawProblem, Eigen::Dynamic, 1>;
  ceres::TinySolver<Derived> solver{};
  solver.options.max_num_iterations = 10;
  solver.Solve(Derived(problem), &yaw);
  return yaw[0];
}

// Likelihood of an angle about the vertical given all lines, see YawModesFromLines.
class YawLikelihood {
 public:
  YawLikelihood(std::span<const LineView> views, const Camera& camera, const YawOptions& options) {
    constexpr double kAlong = 1.0 * kRadiansPerDegree;  // of edges to the axes of the solid
    constexpr double kAcross = 1.0;                     // px, of a line's ends
    constexpr double kVertical = 0.1;                   // shares of the lines
    constexpr double kClutter = 0.8;
    constexpr double kFullWeight = 40.0;  // px: shorter lines are clutter more often
    const auto with_lines =
        std::ranges::count_if(views, [](const LineView& view) { return !view.lines.empty(); });
    const double share =
        std::min(1.0, options.independent_views / std::max(1.0, static_cast<double>(with_lines)));
    for (const NormalisedLine& line : Normalise(views, camera, LineFit::kRobust)) {
      const double sigma = std::hypot(kAlong, kAcross / line.weight);
      const double a = line.sine_to_vertical / sigma;
      const double other = kVertical / sigma * std::exp(-0.5 * a * a) + kClutter * std::sqrt(2.0 / kPi);
      lines_.push_back({line.image, line.normal, 0.5 / (sigma * sigma),
                        0.5 * (1.0 - kVertical - kClutter) / (sigma * other),
                        share * std::min(1.0, line.weight / kFullWeight)});
    }
  }

  bool Empty() const { return lines_.empty(); }

  // Up to a constant.
  double Log(double yaw) const {
    const Eigen::Vector2d x_axis = AxisAt(yaw);
    const Eigen::Vector2d y_axis(-x_axis.y(), x_axis.x());
    double sum = 0.0;
    for (const Line& line : lines_) {
      const double likelihood = line.Kernel(x_axis) + line.Kernel(y_axis);
      sum += likelihood > 0.0 ? line.weight * std::log1p(line.ratio * likelihood) : 0.0;
    }
    return sum;
  }

 private:
  struct Line {
    Eigen::Matrix2d image;
    Eigen::Vector2d normal;
    double factor;  // half the inverse variance of its angle
    double ratio;   // likelihood of a horizontal axis that fits over that of anything else
    double weight;

    double Kernel(const Eigen::Vector2d& axis) const {
      constexpr double kNone = 9.0;
      const Eigen::Vector2d d = image * axis;
      const double across = d.dot(normal);
      const double half_square = factor * across * across;
      const double norm = d.squaredNorm() + 1e-12;
      return half_square < kNone * norm ? std::exp(-half_square / norm) : 0.0;
    }
  };
  std::vector<Line> lines_;
};

}  // namespace

double AngleToDirection(const LineSegment& line, const Rigid3d& T_map_camera, const Camera& camera,
                        const Eigen::Vector3d& direction_map) {
  const Eigen::Vector2d a = camera.Unproject(line.a).head<2>();
  const Eigen::Vector2d b = camera.Unproject(line.b).head<2>();
  const Eigen::Vector3d d = T_map_camera.RotationMatrix().transpose() * direction_map;
  const Eigen::Vector2d image = d.head<2>() - d.z() * 0.5 * (a + b);
  const double norms = (b - a).norm() * image.norm();
  return norms > 1e-12 ? std::acos(std::min(1.0, std::abs((b - a).dot(image)) / norms)) : kPi / 2.0;
}

AxisOfLine NearestAxis(const LineSegment& line, const Rigid3d& T_map_camera, const Camera& camera,
                       const Eigen::Matrix3d& R_map_object) {
  AxisOfLine nearest{0, kPi};
  for (int axis = 0; axis < 3; ++axis) {
    const double angle = AngleToDirection(line, T_map_camera, camera, R_map_object.col(axis));
    if (angle < nearest.angle) {
      nearest = {axis, angle};
    }
  }
  return nearest;
}

std::optional<YawEstimate> YawFromLines(std::span<const LineView> views, const Camera& camera,
                                        const YawOptions& options) {
  const LineFit fit = options.fit;
  const std::vector<NormalisedLine> lines = Normalise(views, camera, fit);
  if (static_cast<int>(lines.size()) < options.min_lines) {
    return std::nullopt;
  }
  const double max_sine = std::sin(options.match_angle_deg * kRadiansPerDegree);
  double total = 0.0;
  for (const NormalisedLine& line : lines) {
    total += line.weight;
  }
  double best_score = 0.0;
  double best_yaw = 0.0;
  std::vector<Match> best_matches;
  std::vector<Match> matches;
  for (int i = 0; i < options.samples; ++i) {
    const double yaw = -kPi / 4.0 + (i + 0.5) * (kPi / 2.0) / options.samples;
    double score = 0.0;
    MatchLines(lines, yaw, max_sine, fit, matches, score);
    if (score > best_score) {
      best_score = score;
      best_yaw = yaw;
      std::swap(best_matches, matches);
    }
  }
  if (static_cast<int>(best_matches.size()) < std::max(1, options.min_lines - 1)) {
    return std::nullopt;
  }
  const double refined = RefineYaw(lines, best_matches, best_yaw, fit);
  const bool accepted = std::abs(refined - best_yaw) <= options.max_refinement_deg * kRadiansPerDegree;
  const double quality =
      fit == LineFit::kLeastSquares ? 1.0 : best_score / total;  // all frames alike (Eq. 9)
  return YawEstimate{WrapQuarter(accepted ? refined : best_yaw), quality};
}

std::vector<YawMode> YawModesFromLines(std::span<const LineView> views, const Camera& camera,
                                       const YawOptions& options) {
  constexpr int kSamples = 60;
  constexpr double kStep = 0.5 * kPi / kSamples;
  constexpr double kFine = 0.5 * kRadiansPerDegree;
  constexpr double kParallel = 1.0 * kRadiansPerDegree;  // standard deviation of edges from the solid's axes
  constexpr double kMostSigma = 0.5 * kPi / 3.46;        // that of a uniform angle
  constexpr double kLeastShare = 0.05;
  constexpr std::size_t kMost = 3;
  const YawLikelihood likelihood(views, camera, options);
  std::vector<YawMode> modes;
  if (likelihood.Empty()) {
    return modes;
  }
  std::array<double, kSamples> logs{};
  for (int i = 0; i < kSamples; ++i) {
    logs[i] = likelihood.Log(i * kStep);
  }
  const double best = *std::ranges::max_element(logs);
  double sum = 0.0;
  for (int i = 0; i < kSamples; ++i) {
    if (logs[i] < logs[(i + 1) % kSamples] || logs[i] <= logs[(i + kSamples - 1) % kSamples] ||
        logs[i] < best - 10.0) {
      continue;
    }
    double yaw = i * kStep;
    double height = logs[i];
    for (double step = 0.5 * kStep; step > 0.1 * kFine; step *= 0.5) {
      for (const double other : {yaw - step, yaw + step}) {
        const double log = likelihood.Log(other);
        if (log > height) {
          yaw = other;
          height = log;
        }
      }
    }
    const double curvature =
        (2.0 * height - likelihood.Log(yaw - kFine) - likelihood.Log(yaw + kFine)) / (kFine * kFine);
    const double sigma =
        std::min(kMostSigma, std::hypot(kParallel, 1.0 / std::sqrt(std::max(curvature, 1e-9))));
    modes.push_back({WrapQuarter(yaw), sigma, std::exp(height - best) * sigma});
    sum += modes.back().share;
  }
  std::ranges::sort(modes, std::greater(), &YawMode::share);
  for (YawMode& mode : modes) {
    mode.share /= sum;
  }
  std::erase_if(modes, [](const YawMode& mode) { return mode.share < kLeastShare; });
  modes.resize(std::min(modes.size(), kMost));
  return modes;
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
  const EigenSystem<2> solver = EigenSystemOf(covariance);
  const double ratio = solver.values[1] / std::max(solver.values[0], 1e-12);
  if (ratio < options.pca_min_ratio) {
    return std::nullopt;
  }
  const Eigen::Vector2d axis = solver.vectors.col(1);
  return YawEstimate{WrapQuarter(std::atan2(axis.y(), axis.x())), 1.0 - 1.0 / ratio};
}

void YawMean::Add(const YawEstimate& estimate) {
  sum_ += std::polar(estimate.quality, 4.0 * estimate.yaw);
  weight_ += estimate.quality;
}

}  // namespace sqslam
