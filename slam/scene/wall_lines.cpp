#include "slam/scene/wall_lines.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstdint>
#include <map>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "slam/geometry/angles.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr int kLevels = 10;             // of a column's height
constexpr int kMinLevels = 5;           // that a column of a wall fills
constexpr double kOutlierShare = 0.02;  // cut off at each end of an axis
constexpr double kCellsAcross = 100.0;  // cells along the longer side of the plan
constexpr int kMargin = 15;             // around the bulk of the points, cells
constexpr double kMinWall = 10.0;       // length, cells
constexpr double kMaxGap = 5.0;         // within a wall, as behind furniture; cells
constexpr int kFitRounds = 5;
constexpr int kMinVotes = 8;        // columns on a line
constexpr double kThickness = 1.2;  // distance of a wall's columns from its line, cells
constexpr double kMaxDepth = 12.0;  // of a cupboard before its wall, cells

std::pair<double, double> BulkAlong(const std::vector<Eigen::Vector3d>& points, int axis) {
  const std::vector<double> values = ToVector(points, [axis](const Eigen::Vector3d& p) { return p[axis]; });
  return {LowerQuantile(values, kOutlierShare), LowerQuantile(values, 1.0 - kOutlierShare)};
}

// Returns the columns that a wall may fill, one a pixel, from a corner of the plan on.
cv::Mat1b TallColumns(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector2d& corner,
                      double cell) {
  const auto [bottom, top] = BulkAlong(points, 2);
  const double level = std::max((top - bottom) / kLevels, 1e-12);
  const int side = static_cast<int>(kCellsAcross) + 2 * kMargin;
  std::map<std::pair<int, int>, std::bitset<kLevels>> filled;
  for (const Eigen::Vector3d& p : points) {
    const double at = (p.z() - bottom) / level;
    const Eigen::Array2d column = ((p.head<2>() - corner) / cell).array().floor();
    if (at >= 0.0 && at < kLevels && (column >= 0.0).all() && (column < side).all()) {
      filled[{static_cast<int>(column.y()), static_cast<int>(column.x())}].set(static_cast<std::size_t>(at));
    }
  }
  cv::Mat1b mask(side, side, std::uint8_t{0});
  for (const auto& [at, levels] : filled) {
    mask(at.first, at.second) = levels.count() >= kMinLevels ? 255 : 0;
  }
  return mask;
}

// Returns a mask of the pixels about a line.
cv::Mat1b StripAbout(const WallLine& line, double half, const cv::Size& size) {
  cv::Mat1b strip(size, std::uint8_t{0});
  cv::line(strip, {cvRound(line.from.x()), cvRound(line.from.y())},
           {cvRound(line.to.x()), cvRound(line.to.y())}, 255, cvCeil(2.0 * half));
  return strip;
}

// A wall in a mask of columns, pixels.
struct FittedWall {
  WallLine seed, line;
  std::size_t columns = 0;
};

// Fits a line to the columns about it, along which it grows over gaps and into corners.
FittedWall FitWall(const WallLine& seed, const cv::Mat1b& mask) {
  WallLine line = seed;
  std::vector<cv::Point> columns;
  for (int round = 0; round < kFitRounds; ++round) {
    const Eigen::Vector2d reach = kMaxGap * (line.to - line.from).normalized();
    cv::findNonZero(mask & StripAbout({line.from - reach, line.to + reach}, kThickness, mask.size()),
                    columns);
    cv::Vec4f fit;
    cv::fitLine(columns, fit, cv::DIST_L2, 0.0, 0.01, 0.01);
    const Eigen::Vector2d direction(fit[0], fit[1]), mean(fit[2], fit[3]);
    double first = 0.0, last = 0.0;
    for (const cv::Point& column : columns) {
      const double at = (Eigen::Vector2d(column.x, column.y) - mean).dot(direction);
      first = std::min(first, at);
      last = std::max(last, at);
    }
    line = {mean + first * direction, mean + last * direction};
  }
  return {seed, line, columns.size()};
}

// Returns the wall with the most columns, of those whose line goes through `open` columns; nothing if none is
// as long as a wall.
std::optional<FittedWall> FullestWall(const cv::Mat1b& open, const cv::Mat1b& columns) {
  std::vector<cv::Vec4i> lines;
  cv::HoughLinesP(open, lines, 1.0, kRadiansPerDegree, kMinVotes, kMinWall, kMaxGap);
  FittedWall fullest;
  for (const cv::Vec4i& line : lines) {
    const FittedWall wall = FitWall({{line[0], line[1]}, {line[2], line[3]}}, columns);
    fullest = wall.columns > fullest.columns ? wall : fullest;
  }
  return fullest.columns > 0 ? std::optional(fullest) : std::nullopt;
}

// Returns true if `front` runs along a part of `wall`, as the front of a cupboard does: nearly parallel to it
// and not far from it.
bool IsBefore(const WallLine& front, const WallLine& wall, double reach) {
  constexpr double kMaxSlope = 0.2;
  const Eigen::Vector2d direction = (wall.to - wall.from).normalized();
  const Eigen::Vector2d normal(-direction.y(), direction.x());
  const auto along = [&](const Eigen::Vector2d& p) {
    return std::clamp((p - wall.from).dot(direction), 0.0, wall.Length());
  };
  const double shared = std::abs(along(front.to) - along(front.from));
  const double apart = std::abs((0.5 * (front.from + front.to) - wall.from).dot(normal));
  return std::abs((front.to - front.from).normalized().dot(normal)) < kMaxSlope && apart < reach &&
         shared > (apart < 0.25 * reach ? 0.0 : 0.5 * front.Length());
}

// Merges walls that run along each other into the one that is farther out, as the wall is behind a cupboard
// before it. It then spans both, in the direction of the longer one.
std::vector<WallLine> DrawnOnce(std::vector<WallLine> walls, double reach) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  double length = 0.0;
  for (const WallLine& wall : walls) {
    middle += wall.Length() * 0.5 * (wall.from + wall.to);
    length += wall.Length();
  }
  middle /= std::max(length, 1e-12);
  const auto outwards = [&middle](const WallLine& wall) {
    const Eigen::Vector2d direction = (wall.to - wall.from).normalized();
    return std::abs((middle - wall.from).dot(Eigen::Vector2d(-direction.y(), direction.x())));
  };
  std::ranges::sort(walls, std::ranges::greater(), outwards);
  std::vector<WallLine> once;
  for (const WallLine& wall : walls) {
    const auto behind = std::ranges::find_if(once, [&](const WallLine& outer) {
      return IsBefore(wall, outer, reach) || IsBefore(outer, wall, reach);
    });
    if (behind == once.end()) {
      once.push_back(wall);
      continue;
    }
    const WallLine& longer = wall.Length() > behind->Length() ? wall : *behind;
    const Eigen::Vector2d direction = (longer.to - longer.from).normalized();
    const Eigen::Vector2d middle_behind = 0.5 * (behind->from + behind->to);
    double first = 0.0, last = 0.0;
    for (const Eigen::Vector2d& end : {behind->from, behind->to, wall.from, wall.to}) {
      first = std::min(first, (end - middle_behind).dot(direction));
      last = std::max(last, (end - middle_behind).dot(direction));
    }
    *behind = {middle_behind + first * direction, middle_behind + last * direction};
  }
  return once;
}

}  // namespace

std::vector<WallLine> FindWallLines(const std::vector<Eigen::Vector3d>& points) {
  if (points.empty()) {
    return {};
  }
  const auto [left, right] = BulkAlong(points, 0);
  const auto [bottom, top] = BulkAlong(points, 1);
  const double cell = std::max({right - left, top - bottom, 1e-9}) / kCellsAcross;
  const Eigen::Vector2d corner = Eigen::Vector2d(left, bottom) - Eigen::Vector2d::Constant(kMargin * cell);
  const cv::Mat1b columns = TallColumns(points, corner, cell);
  cv::Mat1b open = columns.clone();  // columns that are in no wall
  std::vector<WallLine> walls;
  while (const std::optional<FittedWall> wall = FullestWall(open, columns)) {
    const auto& [seed, line, count] = *wall;
    open.setTo(0,
               StripAbout(line, 2.0 * kThickness, open.size()) | StripAbout(seed, kThickness, open.size()));
    const Eigen::Vector2d half = Eigen::Vector2d::Constant(0.5);
    walls.push_back({corner + cell * (line.from + half), corner + cell * (line.to + half)});
  }
  walls = DrawnOnce(std::move(walls), kMaxDepth * cell);
  std::ranges::sort(walls, std::ranges::greater(), &WallLine::Length);
  return walls;
}

}  // namespace sqslam
