#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <span>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// A shadow on a plane: a picture of its darkness and where that lies.
struct GroundShadow {
  cv::Mat darkness;  // 8UC1, 255 where no light arrives; empty where nothing casts a shadow
  Eigen::Vector3d corner = Eigen::Vector3d::Zero();  // map frame, of the first pixel
  Eigen::Vector3d across = Eigen::Vector3d::Zero();  // to the end of the first row
  Eigen::Vector3d down = Eigen::Vector3d::Zero();    // to the end of the first column
};

struct ShadowLight {
  Eigen::Vector3d towards = Eigen::Vector3d::UnitZ();  // the lamp, map frame
  double size = 0.16;     // angle between the middle and the rim of the lamp, radians
  double lamp = 0.6;      // share of the lamp in the light; the rest comes from the whole sky
  int lamp_samples = 24;  // directions; what a shadow costs is in proportion to their number
  int sky_samples = 32;
};

// The plane is {p : up . p = height}. The lamp and the sky are sampled by a fixed set of directions, each of
// which throws the solids' convex outlines on the plane, so that the edge of a shadow is the softer the
// higher the edge that throws it. What reaches below the plane counts as lying on it.
GroundShadow CastGroundShadow(std::span<const PosedSuperquadric> solids, const Eigen::Vector3d& up,
                              double height, const ShadowLight& light, int resolution = 512);

}  // namespace sqslam
