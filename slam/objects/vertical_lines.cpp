#include "slam/objects/vertical_lines.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "slam/geometry/angles.h"

namespace sqslam {
namespace {

constexpr double kReach = 12.0 * kRadiansPerDegree;

// A line that may be vertical.
struct Line {
  Eigen::Vector3d normal;  // of the plane through the line and the camera centre, unit, map frame
  double factor;           // half the inverse variance of its angle
  double ratio;            // likelihood of a vertical edge that fits over that of anything else
  double weight;
};

std::vector<Line> NearlyVertical(std::span<const LineView> views, const Camera& camera,
                                 const Eigen::Vector3d& up) {
  constexpr double kAlong = 1.0 * kRadiansPerDegree;  // of edges from the vertical
  constexpr double kAcross = 1.0;                     // px, of a line's ends
  constexpr double kVertical = 0.2;                   // share of the lines
  constexpr double kFullWeight = 40.0;                // px: shorter lines are clutter more often
  constexpr double kIndependent = 4.0;                // effective number of views: their errors are alike
  const double share = std::min(1.0, kIndependent / std::max(1.0, static_cast<double>(views.size())));
  const double most = std::sin(2.0 * kReach);
  std::vector<Line> lines;
  for (const LineView& view : views) {
    for (const LineSegment& segment : view.lines) {
      const Eigen::Vector3d across =
          view.T_map_camera.rotation * camera.Unproject(segment.a).cross(camera.Unproject(segment.b));
      const double length = segment.Length();
      if (across.norm() <= 1e-12 || std::abs(across.normalized().dot(up)) > most) {
        continue;
      }
      const double sigma = std::hypot(kAlong, kAcross / length);
      const double fits = kVertical / (sigma * std::sqrt(2.0 * std::numbers::pi));
      lines.push_back({across.normalized(), 0.5 / (sigma * sigma), fits / (1.0 - kVertical),
                       share * std::min(1.0, length / kFullWeight)});
    }
  }
  return lines;
}

// Logarithm of the likelihood of a vertical direction given the lines of one object, up to a constant.
double LogLikelihood(const std::vector<Line>& lines, const Eigen::Vector3d& vertical) {
  constexpr double kNone = 9.0;
  double sum = 0.0;
  for (const Line& line : lines) {
    const double off = line.normal.dot(vertical);
    const double half_square = line.factor * off * off;
    sum += half_square < kNone ? line.weight * std::log1p(line.ratio * std::exp(-half_square)) : 0.0;
  }
  return sum;
}

// An object's lines, with the likelihood of the direction that suits them best.
struct Vote {
  std::vector<Line> lines;
  double best = 0.0;

  double Loss(const Eigen::Vector3d& vertical) const {
    return std::log1p(std::max(0.0, best - LogLikelihood(lines, vertical)));
  }
};

// Returns all horizontal tilts within reach, a degree apart; radians.
std::vector<Eigen::Vector2d> TiltsWithinReach() {
  constexpr double kStep = 1.0 * kRadiansPerDegree;
  constexpr int kSteps = static_cast<int>(kReach / kStep);
  std::vector<Eigen::Vector2d> tilts;
  for (int i = -kSteps; i <= kSteps; ++i) {
    for (int j = -kSteps; j <= kSteps; ++j) {
      if (i * i + j * j <= kSteps * kSteps) {
        tilts.emplace_back(kStep * i, kStep * j);
      }
    }
  }
  return tilts;
}

}  // namespace

std::optional<VerticalEdges> VerticalFromLines(std::span<const std::vector<LineView>> lines,
                                               const Camera& camera, const Eigen::Vector3d& up) {
  constexpr double kTells = 3.0;  // log likelihood of an object's best direction over that of the average one
  constexpr std::size_t kFewest = 3;
  constexpr double kPlaneSigma = 3.0 * kRadiansPerDegree;  // with a heavy tail
  constexpr double kFinest = 0.05 * kRadiansPerDegree;
  const Eigen::Vector3d x_axis = up.unitOrthogonal();
  const Eigen::Vector3d y_axis = up.cross(x_axis);
  const auto direction = [&](const Eigen::Vector2d& tilt) -> Eigen::Vector3d {
    return (up + tilt.x() * x_axis + tilt.y() * y_axis).normalized();
  };
  const std::vector<Eigen::Vector2d> grid = TiltsWithinReach();
  std::vector<Vote> votes;
  for (const std::vector<LineView>& of_object : lines) {
    Vote vote{NearlyVertical(of_object, camera, up)};
    double sum = 0.0;
    for (const Eigen::Vector2d& tilt : grid) {
      const double log = LogLikelihood(vote.lines, direction(tilt));
      vote.best = std::max(vote.best, log);
      sum += log;
    }
    if (vote.best - sum / static_cast<double>(grid.size()) > kTells) {
      votes.push_back(std::move(vote));
    }
  }
  if (votes.size() < kFewest) {
    return std::nullopt;
  }
  const auto loss = [&](const Eigen::Vector2d& tilt) {
    const Eigen::Vector3d vertical = direction(tilt);
    return std::transform_reduce(votes.begin(), votes.end(),
                                 std::log1p(tilt.squaredNorm() / (kPlaneSigma * kPlaneSigma)), std::plus(),
                                 [&](const Vote& vote) { return vote.Loss(vertical); });
  };
  Eigen::Vector2d best = Eigen::Vector2d::Zero();
  double least = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Eigen::Vector2d& tilt) {
    const double candidate = loss(tilt);
    if (candidate < least) {
      least = candidate;
      best = tilt;
    }
  };
  std::ranges::for_each(grid, consider);
  for (double step = 0.5 * kRadiansPerDegree; step > kFinest; step *= 0.5) {
    const Eigen::Vector2d middle = best;
    for (const double x : {-step, 0.0, step}) {
      for (const double y : {-step, 0.0, step}) {
        consider(middle + Eigen::Vector2d(x, y));
      }
    }
  }
  return VerticalEdges{direction(best), loss(Eigen::Vector2d::Zero()) - least};
}

}  // namespace sqslam
