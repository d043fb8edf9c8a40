#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <span>
#include <vector>

#include "slam/geometry/angles.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/objects/object_options.h"
#include "slam/objects/object_types.h"

namespace sqslam {

// The lines of one object in one view.
struct LineView {
  Rigid3d T_map_camera;
  std::vector<LineSegment> lines;  // undistorted px
  // Point (map frame) at which the object's axes are projected; empty: at each line's midpoint, which avoids
  // a perspective error for lines away from it.
  std::optional<Eigen::Vector3d> p_axes = {};

  static void VisitState(auto& self, auto&& visit) { visit(self.T_map_camera, self.lines, self.p_axes); }
};

// Returns the angle between a line and the image of a map direction at the line's midpoint (which points to
// the vanishing point of the direction), radians in [0, pi/2]; pi/2 for a line without length.
double AngleToDirection(const LineSegment& line, const Rigid3d& T_map_camera, const Camera& camera,
                        const Eigen::Vector3d& direction_map);

// The object axis that a line is most parallel to.
struct AxisOfLine {
  int axis = 0;        // 0, 1, 2: x, y, z
  double angle = 0.0;  // AngleToDirection() of the line and the axis, radians
};
AxisOfLine NearestAxis(const LineSegment& line, const Rigid3d& T_map_camera, const Camera& camera,
                       const Eigen::Matrix3d& R_map_object);

// Yaw from line segments (section "Pose Estimation"): the axes of the object are parallel to its edges. Of 18
// start angles over 90 degrees the one with the best matches (angle between projected axis and line below
// options.match_angle_deg) is refined by Levenberg-Marquardt over the accumulated angle error. The axes are
// projected at each line's midpoint, i.e. compared with the direction to the axis' vanishing point, without a
// perspective error for lines away from the object's centre. One view is the paper's estimate, many views
// give the joint one. Empty if the lines match no horizontal axis.
std::optional<YawEstimate> YawFromLines(std::span<const LineView> views, const Camera& camera,
                                        const YawOptions& options);

// An angle about the map's z axis, modulo 90 degrees, supported by lines.
struct YawMode {
  double yaw = 0.0;    // radians, in [-pi/4, pi/4)
  double sigma = 0.0;  // standard deviation, radians
  double share = 1.0;  // probability of this mode
};

// Returns the modes of the yaw from the lines of many views, at most three, the likeliest first. A line shows
// one of the two horizontal axes, the vertical one, or clutter; the likelihood of an angle is that of all
// lines, its precision the curvature there, its share the mass of its peak. Long lines count alike: an edge
// is one piece of evidence at any resolution. Line errors repeat from view to view, so many views count no
// more than options.independent_views. Empty without lines, or if the likelihood is flat.
std::vector<YawMode> YawModesFromLines(std::span<const LineView> views, const Camera& camera,
                                       const YawOptions& options);

// Yaw from the principal axis of the points' horizontal projection, for objects without straight edges. Empty
// if the cloud is round (variance ratio below options.pca_min_ratio) or small.
std::optional<YawEstimate> YawFromPoints(std::span<const Eigen::Vector3d> points, const YawOptions& options);

// Weighted running mean of angles modulo 90 degrees, taken on the circle of 4 * yaw: the mean of 44 and -44
// degrees is 45, not 0.
class YawMean {
 public:
  void Add(const YawEstimate& estimate);
  void Merge(const YawMean& other) { sum_ += other.sum_, weight_ += other.weight_; }
  void Rotate(double angle) { sum_ *= std::polar(1.0, 4.0 * angle); }  // applies a rotation of the frame
  bool Empty() const { return weight_ <= 0.0; }
  double Mean() const { return WrapQuarter(std::arg(sum_) / 4.0); }
  double Concentration() const { return weight_ > 0.0 ? std::abs(sum_) / weight_ : 0.0; }  // 1: all equal

  static void VisitState(auto& self, auto&& visit) { visit(self.sum_, self.weight_); }

 private:
  std::complex<double> sum_ = 0.0;
  double weight_ = 0.0;
};

}  // namespace sqslam
