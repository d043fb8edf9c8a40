#include "render/figures/wall_lines.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <map>
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
constexpr double kMinWall = 10.0;       // length, cells
constexpr double kMaxGap = 5.0;         // within a wall, as behind furniture; cells
constexpr double kThickness = 1.2;      // distance of a wall's columns from its line, cells

std::pair<double, double> BulkAlong(const std::vector<Eigen::Vector3d>& points, int axis) {
  const std::vector<double> values = ToVector(points, [axis](const Eigen::Vector3d& p) { return p[axis]; });
  return {LowerQuantile(values, kOutlierShare), LowerQuantile(values, 1.0 - kOutlierShare)};
}

// Returns the centres of the columns that a wall may fill, in cells.
std::vector<Eigen::Vector2d> TallColumns(const std::vector<Eigen::Vector3d>& points, double cell) {
  const auto [bottom, top] = BulkAlong(points, 2);
  const double level = std::max((top - bottom) / kLevels, 1e-12);
  std::map<std::pair<int, int>, std::bitset<kLevels>> filled;
  for (const Eigen::Vector3d& p : points) {
    const double at = (p.z() - bottom) / level;
    if (at >= 0.0 && at < kLevels) {
      filled[{static_cast<int>(std::floor(p.x() / cell)), static_cast<int>(std::floor(p.y() / cell))}].set(
          static_cast<std::size_t>(at));
    }
  }
  std::vector<Eigen::Vector2d> columns;
  for (const auto& [at, levels] : filled) {
    if (levels.count() >= kMinLevels) {
      columns.emplace_back(at.first + 0.5, at.second + 0.5);
    }
  }
  return columns;
}

// Returns the columns of the longest stretch without a gap within a wall's thickness of a line (cells).
std::vector<std::size_t> LongestStretch(const std::vector<Eigen::Vector2d>& columns,
                                        const Eigen::Vector2d& direction, double offset) {
  const Eigen::Vector2d normal(-direction.y(), direction.x());
  std::vector<std::pair<double, std::size_t>> along;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (std::abs(columns[i].dot(normal) - offset) <= kThickness) {
      along.emplace_back(columns[i].dot(direction), i);
    }
  }
  std::ranges::sort(along);
  std::pair<std::size_t, std::size_t> best;  // first, end
  for (std::size_t first = 0, end = 0; first < along.size(); first = end) {
    for (end = first + 1; end < along.size() && along[end].first - along[end - 1].first <= kMaxGap;) {
      ++end;
    }
    best = end - first > best.second - best.first ? std::pair(first, end) : best;
  }
  std::vector<std::size_t> stretch;
  for (std::size_t i = best.first; i < best.second; ++i) {
    stretch.push_back(along[i].second);
  }
  return stretch;
}

// Returns the stretch with the most columns of all lines.
std::vector<std::size_t> FullestStretch(const std::vector<Eigen::Vector2d>& columns) {
  std::vector<std::size_t> best;
  for (int degrees = 0; degrees < 180; ++degrees) {
    const double angle = degrees * kRadiansPerDegree;
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    const Eigen::Vector2d normal(-direction.y(), direction.x());
    std::map<int, std::size_t> counts;  // by offset
    for (const Eigen::Vector2d& column : columns) {
      ++counts[static_cast<int>(std::floor(column.dot(normal)))];
    }
    const auto fullest = std::ranges::max_element(counts, {}, [](const auto& count) { return count.second; });
    if (fullest == counts.end() || 3 * fullest->second < best.size()) {
      continue;
    }
    std::vector<std::size_t> stretch = LongestStretch(columns, direction, fullest->first + 0.5);
    best = stretch.size() > best.size() ? std::move(stretch) : best;
  }
  return best;
}

// Fits a line to columns by total least squares.
WallLine FitLine(const std::vector<Eigen::Vector2d>& columns, const std::vector<std::size_t>& members) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const std::size_t i : members) {
    mean += columns[i] / static_cast<double>(members.size());
  }
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const std::size_t i : members) {
    spread += (columns[i] - mean) * (columns[i] - mean).transpose();
  }
  const Eigen::Vector2d direction =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(spread).eigenvectors().col(1);
  double first = 0.0, last = 0.0;
  for (const std::size_t i : members) {
    const double at = (columns[i] - mean).dot(direction);
    first = std::min(first, at);
    last = std::max(last, at);
  }
  return {mean + first * direction, mean + last * direction};
}

double DistanceTo(const WallLine& wall, const Eigen::Vector2d& p) {
  const Eigen::Vector2d line = wall.to - wall.from;
  const double t = std::clamp((p - wall.from).dot(line) / std::max(line.squaredNorm(), 1e-12), 0.0, 1.0);
  return (p - wall.from - t * line).norm();
}

}  // namespace

std::vector<WallLine> FindWallLines(const std::vector<Eigen::Vector3d>& points) {
  if (points.empty()) {
    return {};
  }
  const auto [left, right] = BulkAlong(points, 0);
  const auto [bottom, top] = BulkAlong(points, 1);
  const double cell = std::max({right - left, top - bottom, 1e-9}) / kCellsAcross;
  std::vector<Eigen::Vector2d> columns = TallColumns(points, cell);
  std::vector<WallLine> walls;
  while (true) {
    const std::vector<std::size_t> members = FullestStretch(columns);
    if (members.size() < kMinWall) {
      break;
    }
    const WallLine wall = FitLine(columns, members);
    if (wall.Length() >= kMinWall) {
      walls.push_back({cell * wall.from, cell * wall.to});
    }
    std::vector<bool> used(columns.size());
    for (const std::size_t i : members) {
      used[i] = true;
    }
    std::vector<Eigen::Vector2d> rest;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (!used[i] && DistanceTo(wall, columns[i]) > 2.0 * kThickness) {
        rest.push_back(columns[i]);
      }
    }
    columns = std::move(rest);
  }
  std::ranges::sort(walls, std::ranges::greater(), &WallLine::Length);
  return walls;
}

}  // namespace sqslam
