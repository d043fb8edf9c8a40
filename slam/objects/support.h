#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "slam/geometry/rigid3.h"
#include "slam/geometry/superquadric.h"
#include "slam/objects/object_options.h"

namespace sqslam {

// The median of each coordinate and the median distance from there: far stray points don't count.
struct CloudMiddle {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 0.0;
};
CloudMiddle MiddleOf(std::span<const Eigen::Vector3d> points);  // at least one

// A horizontal surface that things stand on: a desk, a shelf, the floor.
struct SupportSurface {
  double height = 0.0;                  // map units, along the map's z axis
  std::vector<Eigen::Vector2d> points;  // x and y of the map points on it; empty: it is everywhere
};

// The horizontal surfaces of a map whose z axis points up.
class SupportSurfaces {
 public:
  SupportSurfaces() = default;

  // A single surface without end.
  static SupportSurfaces Everywhere(double height);

  // Heights that many more points share than lie just above and below. `points`: map frame, z up.
  static SupportSurfaces Find(std::span<const Eigen::Vector3d> points, const GravityOptions& options);

  // Heights at which something at `place` (x and y) may stand, from high to low: of the surfaces at most as
  // high as `highest` with points within `radius` of the place or all around it.
  std::vector<double> Under(const Eigen::Vector2d& place, double radius, double highest) const;

  // The surfaces as something at `place` (x and y) finds them: without the points on top of objects that it
  // does not stand on. The top of a keyboard is no support for the cup beside it.
  SupportSurfaces Around(const Eigen::Vector2d& place, std::span<const PosedSuperquadric> others) const;

  // Thickness of a surface's layer of points, map units.
  double Tolerance() const { return tolerance_; }
  const std::vector<SupportSurface>& All() const { return surfaces_; }  // from high to low

  void Transform(const Sim3d& S_new_old);  // of a motion that keeps z up

 private:
  std::vector<SupportSurface> surfaces_;
  double tolerance_ = 0.0;
};

}  // namespace sqslam
