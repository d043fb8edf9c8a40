#pragma once

#include <Eigen/Core>

namespace sqslam {

// Round things are seldom cylinders: the neck of a bottle, the foot of a bowl and the ends of a vase are
// narrower than the middle. Their superquadric is the hull, which touches the left and right edges of their
// boxes but not the upper and lower ones. A tapered solid has the hull's width in the middle and `taper`
// times that width at an end; taper 1 is the superquadric itself.

// Support function of the end towards u.z and of the middle, whichever reaches farther, in the direction n.
struct TaperedSupport {
  double value = 0.0;
  Eigen::Vector3d by_u = Eigen::Vector3d::Zero();
  double by_log_taper = 0.0;
  double by_p1 = 0.0;
  double by_p2 = 0.0;

  // `u`: n times the half sizes, by coordinate. `p1`, `p2`: the dual norm's powers, see DualPower().
  TaperedSupport(const Eigen::Vector3d& u, double taper, double p1, double p2);
};

// Width at the height z above the centre, as a share of that in the middle: linear up to the end.
struct TaperedWidth {
  double value = 1.0;
  double by_z = 0.0;
  double by_log_half = 0.0;  // half: half size along z
  double by_log_taper = 0.0;

  TaperedWidth(double z, double half, double taper);
};

}  // namespace sqslam
