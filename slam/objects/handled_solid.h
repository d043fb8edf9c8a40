#pragma once

#include <Eigen/Core>

namespace sqslam {

// A cup is a round body with a handle on one side: no symmetric solid touches all its boxes, neither the
// narrow ones from where the handle is behind the body nor those it widens to the left or to the right only.
// The superquadric of such an object is the hull, with the handle at the end of its x axis. The body is the
// superquadric of the hull's width along y, at the other end of the x axis; the handle is an upright bar.
struct HandledBody {
  Eigen::Vector3d half = Eigen::Vector3d::Ones();  // half sizes of the body
  double shift = 0.0;                              // of its centre from the hull's, along x

  // `hull`: half sizes. Without a handle the body is the hull.
  HandledBody(const Eigen::Vector3d& hull, bool handled);

  // Converts a gradient with respect to the body (logs of its half sizes, shift along x) into the gradient
  // with respect to the logs of the hull's half sizes.
  Eigen::Vector3d ByLogHull(const Eigen::Vector3d& by_log_half, double by_shift) const;

 private:
  Eigen::Vector3d hull_;
  bool handled_;
};

// Support function of the handle in the direction n of the object frame.
struct HandleSupport {
  double value = 0.0;
  Eigen::Vector3d by_log_hull = Eigen::Vector3d::Zero();

  HandleSupport(const Eigen::Vector3d& n, const Eigen::Vector3d& hull);
};

}  // namespace sqslam
