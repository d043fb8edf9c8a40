#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <span>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// A shadow on a plane: a picture of its darkness and the place of that picture.
struct GroundShadow {
  cv::Mat darkness;                                  // 8UC1, 255: no light arrives; empty: no shadow
  Eigen::Vector3d corner = Eigen::Vector3d::Zero();  // map frame, of the first pixel
  Eigen::Vector3d across = Eigen::Vector3d::Zero();  // to the end of the first row
  Eigen::Vector3d down = Eigen::Vector3d::Zero();    // to the end of the first column
};

struct ShadowLight {
  Eigen::Vector3d towards = Eigen::Vector3d::UnitZ();  // direction to the lamp, map frame
  double size = 0.16;                                  // angular radius of the lamp, radians
  double lamp = 0.6;      // share of light from the lamp; the rest comes from the sky
  int lamp_samples = 24;  // number of directions; the cost is proportional
  int sky_samples = 32;
};

// Casts shadows on the plane {p : up . p = height}. A fixed set of directions samples lamp and sky. Each
// projects the solids' convex outlines onto the plane, so that higher edges cast softer shadows. Parts below
// the plane count as lying on it.
GroundShadow CastGroundShadow(std::span<const PosedSuperquadric> solids, const Eigen::Vector3d& up,
                              double height, const ShadowLight& light);

}  // namespace sqslam
