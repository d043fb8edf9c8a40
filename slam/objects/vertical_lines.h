#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/objects/yaw.h"

namespace sqslam {

// The vertical direction that the edges of objects show.
struct VerticalEdges {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  // unit, map frame
  double gain = 0.0;                              // its log likelihood over that of the plane's normal
};

// Finds the vertical direction within 12 degrees of `up`, the normal of a horizontal plane, which counts as
// evidence too. `lines`: those of each object. The image of a vertical edge and the camera centre span a
// plane that contains the direction. Each object has one vote, because all edges of a chair's back lean
// alike. Empty if fewer than three objects have edges that tell.
std::optional<VerticalEdges> VerticalFromLines(std::span<const std::vector<LineView>> lines,
                                               const Camera& camera, const Eigen::Vector3d& up);

}  // namespace sqslam
