#include "slam/objects/support.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// Counts the sorted heights below a limit that only rises.
class RisingCount {
 public:
  explicit RisingCount(const std::vector<double>& heights) : heights_(&heights) {}

  int Below(double limit) {
    while (count_ < heights_->size() && (*heights_)[count_] < limit) {
      ++count_;
    }
    return static_cast<int>(count_);
  }

 private:
  const std::vector<double>* heights_;
  std::size_t count_ = 0;
};

struct Peak {
  double height = 0.0;
  double contrast = 0.0;  // points in the layer less those in layers beside it
};

// Finds layers of thickness `layer` that hold more points than the layers a little above and below.
std::vector<Peak> Peaks(const std::vector<double>& heights, double layer, double min_points) {
  std::vector<Peak> peaks;
  std::vector<RisingCount> counts(6, RisingCount(heights));
  for (const double begin : heights) {
    const int first = counts[2].Below(begin);
    const int inside = counts[3].Below(begin + layer) - first;
    const int below = counts[1].Below(begin - layer) - counts[0].Below(begin - 2.0 * layer);
    const int above = counts[5].Below(begin + 3.0 * layer) - counts[4].Below(begin + 2.0 * layer);
    const double beside = 0.5 * (below + above);
    const double contrast = inside - 1.5 * beside;
    if (contrast >= min_points) {
      peaks.push_back({heights[static_cast<std::size_t>(first + inside / 2)], contrast});
    }
  }
  std::ranges::stable_sort(peaks, [](const Peak& a, const Peak& b) { return a.contrast > b.contrast; });
  return peaks;
}

// Returns the widest angle at `place` without a point, radians.
double WidestGap(const std::vector<Eigen::Vector2d>& points, const Eigen::Vector2d& place) {
  std::vector<double> angles = ToVector(
      points, [&](const Eigen::Vector2d& p) { return std::atan2(p.y() - place.y(), p.x() - place.x()); });
  std::ranges::sort(angles);
  double widest = angles.front() + 2.0 * std::numbers::pi - angles.back();
  for (std::size_t i = 1; i < angles.size(); ++i) {
    widest = std::max(widest, angles[i] - angles[i - 1]);
  }
  return widest;
}

// Returns the middle of the layer that holds the most of the surface's points; its height with few points.
double DensestHeight(const SupportSurface& surface, double layer) {
  constexpr std::size_t kMinPoints = 12;
  if (surface.points.size() < kMinPoints) {
    return surface.height;
  }
  std::vector<double> heights = ToVector(surface.points, [](const Eigen::Vector3d& p) { return p.z(); });
  std::ranges::sort(heights);
  std::ptrdiff_t most = 0;
  double densest = surface.height;
  for (auto begin = heights.begin(); begin != heights.end(); ++begin) {
    const std::ptrdiff_t inside = std::upper_bound(begin, heights.end(), *begin + layer) - begin;
    if (inside > most) {
      most = inside;
      densest = *(begin + inside / 2);
    }
  }
  return densest;
}

// True if the surface is the top of an object under `place`. It then stays a support even if another solid
// seems to cover it: a wrong second solid within a table must not take the table from what stands on it.
bool IsTopUnder(const Eigen::Vector2d& place, double height, std::span<const PosedSuperquadric> others,
                double tolerance) {
  constexpr double kPrecise = 0.1;  // of a mapped height, if that is more than a surface's layer
  return std::ranges::any_of(others, [&](const PosedSuperquadric& other) {
    const double half = other.shape.half_size.z();
    const double top = other.T_map_object.translation.z() + half;
    return std::abs(top - height) < 2.0 * std::max(tolerance, kPrecise * half) && IsOver(place, other);
  });
}

}  // namespace

bool IsOver(const Eigen::Vector2d& p, const PosedSuperquadric& solid, double grown) {
  const Eigen::Vector3d q =
      solid.T_map_object.Inverse() * Eigen::Vector3d(p.x(), p.y(), solid.T_map_object.translation.z());
  return solid.shape.RadialScale(q) < grown;
}

std::vector<Eigen::Vector2d> PointsOn(const SupportSurface& surface, double layer) {
  std::vector<Eigen::Vector2d> points;
  for (const Eigen::Vector3d& p : surface.points) {
    if (std::abs(p.z() - surface.height) < layer) {
      points.emplace_back(p.head<2>());
    }
  }
  return points;
}

bool IsFloor(const std::vector<double>& sorted_heights, double level, double margin) {
  constexpr double kNoise = 0.02;  // share
  const auto below = std::ranges::lower_bound(sorted_heights, level - margin) - sorted_heights.begin();
  return static_cast<double>(below) <= kNoise * static_cast<double>(sorted_heights.size());
}

CloudMiddle MiddleOf(std::span<const Eigen::Vector3d> points) {
  CloudMiddle middle;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::ranges::transform(points, values.begin(), [&](const Eigen::Vector3d& p) { return p[axis]; });
    middle.centre[axis] = UpperMedian(values);
  }
  std::ranges::transform(points, values.begin(),
                         [&](const Eigen::Vector3d& p) { return (p - middle.centre).norm(); });
  middle.radius = UpperMedian(std::move(values));
  return middle;
}

SupportSurfaces SupportSurfaces::Find(std::span<const Eigen::Vector3d> points,
                                      const GravityOptions& options) {
  constexpr double kMinShare = 0.01;
  constexpr double kWellBelow = 8.0;  // layers
  // The floor around a desk is farther away than the desk, so its points scatter more.
  constexpr double kThickFloor = 3.0;  // layers
  constexpr double kWindow = 3.0;      // layers: what lies on the surface may hide its true height
  constexpr std::size_t kMostSurfaces = 12;
  SupportSurfaces result;
  if (static_cast<int>(points.size()) < options.min_points) {
    return result;
  }
  result.tolerance_ = options.inlier_share * MiddleOf(points).radius;
  const double layer = 2.0 * result.tolerance_;
  std::vector<double> heights = ToVector(points, [](const Eigen::Vector3d& p) { return p.z(); });
  std::ranges::sort(heights);
  const double min_points = std::max(12.0, kMinShare * static_cast<double>(points.size()));
  const auto add = [&](double height, double gap) {
    const bool is_new = std::ranges::none_of(
        result.surfaces_, [&](const SupportSurface& other) { return std::abs(other.height - height) < gap; });
    if (is_new && result.surfaces_.size() < kMostSurfaces) {
      result.surfaces_.push_back({height, {}});
    }
  };
  for (const Peak& peak : Peaks(heights, layer, min_points)) {
    add(peak.height, 2.0 * layer);
  }
  const auto is_floor = [&](double height) { return IsFloor(heights, height, kWellBelow * layer); };
  std::ranges::sort(result.surfaces_, std::greater(), &SupportSurface::height);
  if (result.surfaces_.empty() || !is_floor(result.surfaces_.back().height)) {
    for (const Peak& peak : Peaks(heights, kThickFloor * layer, min_points)) {
      if (is_floor(peak.height)) {
        add(peak.height, 2.0 * kThickFloor * layer);
      }
    }
    std::ranges::sort(result.surfaces_, std::greater(), &SupportSurface::height);
  }
  if (!result.surfaces_.empty() && is_floor(result.surfaces_.back().height)) {
    result.floor_ = result.surfaces_.back().height;
  }
  for (const Eigen::Vector3d& p : points) {
    for (SupportSurface& surface : result.surfaces_) {
      if (std::abs(p.z() - surface.height) < kWindow * layer) {
        surface.points.push_back(p);
      }
    }
  }
  return result;
}

std::vector<double> SupportSurfaces::Under(const Eigen::Vector2d& place, double radius,
                                           double highest) const {
  constexpr int kNear = 4;                                // points
  constexpr double kSurrounded = 0.9 * std::numbers::pi;  // widest angle without points
  std::vector<double> heights;
  for (const SupportSurface& surface : surfaces_) {
    if (surface.height > highest) {
      continue;
    }
    const std::vector<Eigen::Vector2d> points = PointsOn(surface, 2.0 * tolerance_);
    const auto near =
        std::ranges::count_if(points, [&](const Eigen::Vector2d& p) { return (p - place).norm() < radius; });
    const bool surrounded = !points.empty() && WidestGap(points, place) < kSurrounded;
    if (near >= kNear || surrounded) {
      heights.push_back(surface.height);
    }
  }
  return heights;
}

SupportSurfaces SupportSurfaces::Around(const Eigen::Vector2d& place,
                                        std::span<const PosedSuperquadric> others) const {
  constexpr double kMayStandOn = 1.3;  // factor on an object's outline up to which its extent is in doubt
  constexpr double kOnTop = 1.1;
  SupportSurfaces result;
  result.tolerance_ = tolerance_;
  result.floor_ = floor_;
  for (const SupportSurface& surface : surfaces_) {
    SupportSurface left = surface;
    for (const PosedSuperquadric& other : others) {
      const double middle = other.T_map_object.translation.z();
      const double reach = other.shape.half_size.z() + 3.0 * tolerance_;
      if (surface.height > middle && surface.height < middle + reach && !IsOver(place, other, kMayStandOn)) {
        std::erase_if(left.points,
                      [&](const Eigen::Vector3d& p) { return IsOver(p.head<2>(), other, kOnTop); });
      }
    }
    const double layer = 2.0 * tolerance_;
    const std::size_t on_surface = PointsOn(left, layer).size();
    const bool stays = 2 * on_surface >= PointsOn(surface, layer).size() ||
                       (on_surface > 0 && IsTopUnder(place, surface.height, others, tolerance_));
    left.height = DensestHeight(left, layer);
    if (stays) {
      result.surfaces_.push_back(std::move(left));
    }
  }
  return result;
}

void SupportSurfaces::Transform(const Sim3d& S_new_old) {
  tolerance_ *= S_new_old.scale;
  const auto moved = [&](double height) { return S_new_old.scale * height + S_new_old.translation.z(); };
  if (floor_) {
    floor_ = moved(*floor_);
  }
  for (SupportSurface& surface : surfaces_) {
    surface.height = moved(surface.height);
    for (Eigen::Vector3d& p : surface.points) {
      p = S_new_old * p;
    }
  }
}

}  // namespace sqslam
