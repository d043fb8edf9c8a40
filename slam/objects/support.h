#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "slam/geometry/rigid3.h"
#include "slam/geometry/superquadric.h"
#include "slam/objects/object_options.h"

namespace sqslam {

// Robust centre and radius: the median of each coordinate and the median distance from there.
struct CloudMiddle {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 0.0;
};
CloudMiddle MiddleOf(std::span<const Eigen::Vector3d> points);  // needs at least one point

// True if `p` (x and y, map frame) lies over the solid, grown by the factor `grown`.
bool IsOver(const Eigen::Vector2d& p, const PosedSuperquadric& solid, double grown = 1.0);

// Returns true if a level is that of the floor: at most as many of the sorted heights as are noise lie more
// than `margin` below it.
bool IsFloor(const std::vector<double>& sorted_heights, double level, double margin);

// A horizontal surface that objects stand on: a desk, a shelf, the floor.
struct SupportSurface {
  double height = 0.0;                  // map units, along the map's z axis
  std::vector<Eigen::Vector3d> points;  // map points on it and a little above and below
};

// Returns x and y of the surface's points that are less than `layer` above or below it.
std::vector<Eigen::Vector2d> PointsOn(const SupportSurface& surface, double layer);

// The horizontal surfaces of a map whose z axis points up.
class SupportSurfaces {
 public:
  SupportSurfaces() = default;

  // Finds heights with many more points than just above and below. `points`: map frame, z up.
  static SupportSurfaces Find(std::span<const Eigen::Vector3d> points, const GravityOptions& options);

  // Returns the heights at which an object at `place` (x and y) may stand, from high to low: those of the
  // surfaces up to `highest` with points within `radius` of the place or all around it.
  std::vector<double> Under(const Eigen::Vector2d& place, double radius, double highest) const;

  // Returns the surfaces for an object at `place` (x and y), without the points on top of objects that it
  // does not stand on: the top of a keyboard does not support the cup beside it, nor raise the desk.
  SupportSurfaces Around(const Eigen::Vector2d& place, std::span<const PosedSuperquadric> others) const;

  // Thickness of a surface's layer of points, map units.
  double Tolerance() const { return tolerance_; }
  const std::vector<SupportSurface>& All() const { return surfaces_; }  // from high to low
  // Returns the height of the lowest surface if hardly a point lies well below it; empty where furniture
  // hides the floor.
  std::optional<double> Floor() const { return floor_; }

  void Transform(const Sim3d& S_new_old);  // must keep z up

 private:
  std::vector<SupportSurface> surfaces_;
  double tolerance_ = 0.0;
  std::optional<double> floor_;
};

}  // namespace sqslam
