#include "slam/objects/part_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "slam/geometry/span_in_box.h"

namespace sqslam {
namespace {

constexpr double kIndependentLines = 150.0;
constexpr std::size_t kMinLines = 60;
constexpr double kMinLogOdds = 3.0;    // 20 to 1
constexpr double kMinExplained = 0.4;  // of the surfaces in the box lie on the parts
constexpr double kDepthNoise = 0.006;  // share of the depth
constexpr double kModelNoise = 0.015;  // share of the object's size: things are not made of boxes
constexpr double kClutter = 0.2;       // share of lines that end elsewhere in the box
constexpr double kGround = 0.1;        // half heights above the bottom, where the ground may show
constexpr double kWrongPass = 0.05;    // share of lines that pass through a solid

constexpr int kCurved = -1;  // axis of a LineSpan that begins at a curved face, or within

// Cuts the span of a line to the unit ball of the first `dimensions` axes. Empty if it misses the ball.
std::optional<LineSpan> WithinBall(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                   int dimensions, LineSpan span) {
  const auto o = origin.head(dimensions);
  const auto d = direction.head(dimensions);
  const double a = d.squaredNorm(), b = o.dot(d), root = b * b - a * (o.squaredNorm() - 1.0);
  if (a == 0.0) {
    return o.squaredNorm() <= 1.0 ? std::optional(span) : std::nullopt;
  }
  if (root <= 0.0) {
    return std::nullopt;
  }
  if (const double begin = (-b - std::sqrt(root)) / a; begin > span.begin) {
    span.begin = begin;
    span.axis = kCurved;
  }
  span.end = std::min(span.end, (-b + std::sqrt(root)) / a);
  return span.begin < span.end ? std::optional(span) : std::nullopt;
}

// Returns where a line is in the part, as the box, cylinder or ellipsoid that its exponents are nearest to.
std::optional<LineSpan> SpanIn(const SolidPart& part, const Eigen::Vector3d& from,
                               const Eigen::Vector3d& along) {
  const Eigen::Vector3d origin = (from - part.centre).cwiseQuotient(part.shape.half_size);
  const Eigen::Vector3d direction = along.cwiseQuotient(part.shape.half_size);
  const Eigen::Vector3d corner = Eigen::Vector3d::Ones();
  const std::optional<LineSpan> in_box =
      SpanInBox<Eigen::Vector3d>(origin, direction, -corner, corner, std::numeric_limits<double>::infinity());
  const SolidKind kind = NearestPrimitive(part.shape.e1, part.shape.e2);
  return !in_box || kind == SolidKind::kCuboid
             ? in_box
             : WithinBall(origin, direction, kind == SolidKind::kCylinder ? 2 : 3, *in_box);
}

class PartFitter {
 public:
  PartFitter(const PosedSuperquadric& hull, const std::vector<SightLine>& lines)
      : half_size_(hull.shape.half_size),
        noise_(kModelNoise * 2.0 * std::cbrt(half_size_.prod())),
        lines_(lines) {}

  // Mean log likelihood of the lines, times the number of independent ones.
  double LogLikelihood(const std::vector<SolidPart>& solids) const {
    double sum = 0.0;
    for (const SightLine& line : lines_) {
      sum += LogLikelihoodOf(line, solids);
    }
    return sum * std::min(1.0, kIndependentLines / static_cast<double>(lines_.size()));
  }

  // Returns the share of the surfaces in the box that lie on the solids.
  double ExplainedShare(const std::vector<SolidPart>& solids) const {
    constexpr double kMaxSigmas = 3.0;
    int inside = 0, explained = 0;
    for (const SightLine& line : lines_) {
      if (!PassesThrough(line)) {
        ++inside;
        const double miss = line.depth - FirstSpan(line, solids).begin;
        explained += std::abs(miss) < kMaxSigmas * NoiseOf(line, 1.0) ? 1 : 0;
      }
    }
    return inside > 0 ? static_cast<double>(explained) / inside : 0.0;
  }

  struct Fit {
    Proportions proportions{};
    int turn = 0;
    double score = -std::numeric_limits<double>::infinity();
  };

  // Finds the proportions with the highest posterior: on a coarse grid, then by steps along each.
  Fit Best(const PartTemplate& of, int turn) const {
    Fit best = BestOnGrid(of, turn);
    for (double step = 0.5; step > 0.02; step *= 0.5) {  // standard deviations of the prior
      for (bool moved = true; moved;) {
        moved = false;
        for (std::size_t i = 0; i < of.free.size(); ++i) {
          for (const double sign : {-1.0, 1.0}) {
            Proportions next = best.proportions;
            next[i] = std::clamp(next[i] + sign * step * of.free[i].sigma, 0.0, 1.0);
            moved |= Improve(of, next, best);
          }
        }
      }
    }
    return best;
  }

 private:
  Fit BestOnGrid(const PartTemplate& of, int turn) const {
    Fit best;
    best.turn = turn;
    int cells = 1;
    for (std::size_t i = 0; i < of.free.size(); ++i) {
      cells *= 3;
    }
    for (int cell = 0; cell < cells; ++cell) {
      Proportions at{};
      for (std::size_t i = 0, rest = static_cast<std::size_t>(cell); i < of.free.size(); ++i, rest /= 3) {
        at[i] =
            std::clamp(of.free[i].mean + (static_cast<double>(rest % 3) - 1.0) * of.free[i].sigma, 0.0, 1.0);
      }
      Improve(of, at, best);
    }
    return best;
  }

  // Takes proportions of a higher posterior density.
  bool Improve(const PartTemplate& of, const Proportions& proportions, Fit& best) const {
    double score = LogLikelihood(PartsWith(of, proportions, half_size_, best.turn));
    for (std::size_t i = 0; i < of.free.size(); ++i) {
      const double sigmas = (proportions[i] - of.free[i].mean) / of.free[i].sigma;
      score -= 0.5 * sigmas * sigmas;
    }
    constexpr double kMinGain = 1e-6;
    if (score <= best.score + kMinGain) {
      return false;
    }
    best.proportions = proportions;
    best.score = score;
    return true;
  }

  static LineSpan FirstSpan(const SightLine& line, const std::vector<SolidPart>& solids) {
    LineSpan first{std::numeric_limits<double>::infinity(), 0.0};
    for (const SolidPart& solid : solids) {
      const std::optional<LineSpan> span = SpanIn(solid, line.origin, line.direction);
      if (span && span->begin < first.begin) {
        first = *span;
      }
    }
    return first;
  }

  // Standard deviation of where a line ends, in its own lengths, at a face that it meets with this cosine.
  double NoiseOf(const SightLine& line, double cosine) const {
    const double length = line.direction.cwiseProduct(half_size_).norm();
    return std::hypot(noise_ / (length * cosine), kDepthNoise * line.depth);
  }

  // A surface at the bottom is what the object stands on.
  bool PassesThrough(const SightLine& line) const {
    const double height = line.origin.z() + line.depth * line.direction.z();
    return line.depth > line.leave + 2.0 * NoiseOf(line, 1.0) || height < kGround - 1.0;
  }

  double LogLikelihoodOf(const SightLine& line, const std::vector<SolidPart>& solids) const {
    const LineSpan first = FirstSpan(line, solids);
    const bool meets = first.begin < line.leave;
    if (PassesThrough(line)) {
      return std::log(meets ? kWrongPass : 1.0 - kClutter);
    }
    const double even = 1.0 / (line.leave - line.enter + 4.0 * NoiseOf(line, 1.0));  // density of clutter
    if (!meets) {
      return std::log(kClutter * even);
    }
    constexpr double kMinCosine = 0.25, kCosineOfCurved = 0.7;
    const Eigen::Vector3d metric = line.direction.cwiseProduct(half_size_);
    const double cosine = first.axis == kCurved
                              ? kCosineOfCurved
                              : std::max(kMinCosine, std::abs(metric[first.axis]) / metric.norm());
    const double sigma = NoiseOf(line, cosine);
    const double miss = (line.depth - first.begin) / sigma;
    const double normal = std::exp(-0.5 * miss * miss) / (sigma * std::sqrt(2.0 * std::numbers::pi));
    return std::log((1.0 - kWrongPass) * ((1.0 - kClutter) * normal + kClutter * even));
  }

  Eigen::Vector3d half_size_;
  double noise_;  // of the solids' surfaces, map units
  const std::vector<SightLine>& lines_;
};

// Pixels that show the hull, as a rectangle; empty if a corner lies behind the camera.
cv::Rect PixelsOf(const PosedSuperquadric& hull, const DepthMap& map) {
  const Rigid3d T_camera_hull = map.T_map_camera.Inverse() * hull.T_map_object;
  const Eigen::AlignedBox3d box(-hull.shape.half_size, hull.shape.half_size);
  Eigen::AlignedBox2d pixels;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p =
        T_camera_hull * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
    if (p.z() <= 0.0) {
      return {};
    }
    pixels.extend(map.camera.Project(p));
  }
  const Eigen::Vector2d end(map.depth.cols, map.depth.rows);
  const Eigen::Vector2i low = pixels.min().cwiseMax(0.0).cwiseMin(end).cast<int>();
  const Eigen::Vector2i high = pixels.max().cwiseMax(0.0).cwiseMin(end).cast<int>();
  return {low.x(), low.y(), high.x() - low.x(), high.y() - low.y()};
}

}  // namespace

std::vector<SightLine> SightLinesThrough(const PosedSuperquadric& hull, const DepthMap& map,
                                         std::size_t most) {
  std::vector<SightLine> lines;
  const cv::Rect pixels = PixelsOf(hull, map);
  if (pixels.empty()) {
    return lines;
  }
  const int step = std::max(
      1,
      static_cast<int>(std::ceil(std::sqrt(static_cast<double>(pixels.area()) / static_cast<double>(most)))));
  const Rigid3d T_hull_camera = hull.T_map_object.Inverse() * map.T_map_camera;
  const SolidPart box{Eigen::Vector3d::Zero(), {Eigen::Vector3d::Ones(), 0.1, 0.1}};
  for (int y = pixels.y + step / 2; y < pixels.br().y; y += step) {
    for (int x = pixels.x + step / 2; x < pixels.br().x; x += step) {
      SightLine line;
      line.depth = map.depth.at<float>(y, x);
      line.origin = T_hull_camera.translation.cwiseQuotient(hull.shape.half_size);
      line.direction =
          (T_hull_camera.rotation * map.camera.Unproject({static_cast<double>(x), static_cast<double>(y)}))
              .cwiseQuotient(hull.shape.half_size);
      const std::optional<LineSpan> span = SpanIn(box, line.origin, line.direction);
      if (!span || !(line.depth > span->begin * (1.0 - 2.0 * kDepthNoise))) {
        continue;
      }
      line.enter = span->begin;
      line.leave = span->end;
      lines.push_back(line);
    }
  }
  return lines;
}

PartFit FitParts(const PosedSuperquadric& hull, const std::vector<PartTemplate>& templates,
                 const std::vector<SightLine>& lines) {
  PartFit best{{}, -std::numeric_limits<double>::infinity()};
  if (lines.size() < kMinLines) {
    return best;
  }
  const PartFitter fitter(hull, lines);
  const double whole = fitter.LogLikelihood(
      {{Eigen::Vector3d::Zero(), {Eigen::Vector3d::Ones(), hull.shape.e1, hull.shape.e2}}});
  for (const PartTemplate& of : templates) {
    for (int turn = 0; turn < of.QuarterTurns(); ++turn) {
      const PartFitter::Fit fit = fitter.Best(of, turn);
      const double cost =
          0.5 * static_cast<double>(of.free.size()) * std::log(kIndependentLines) +
          std::log(static_cast<double>(of.QuarterTurns()) * static_cast<double>(templates.size()));
      if (const double odds = fit.score - cost - whole; odds > best.log_odds) {
        best = {PartsWith(of, fit.proportions, hull.shape.half_size, turn), odds};
      }
    }
  }
  if (best.log_odds < kMinLogOdds || fitter.ExplainedShare(best.parts) < kMinExplained) {
    best.parts.clear();
  }
  return best;
}

}  // namespace sqslam
