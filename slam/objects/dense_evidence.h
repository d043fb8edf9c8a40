#pragma once

#include <Eigen/Core>
#include <map>
#include <span>
#include <vector>

#include "slam/objects/landmark.h"
#include "slam/objects/landmark_estimation.h"

namespace sqslam {

// A point of the dense cloud, map frame.
struct SurfacePoint {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // unit vector, facing the cameras
};

// Returns the points of the cloud that belong to the landmark: inside nearly all of its boxes, near its
// estimate and in large connected components. Excludes points of planes that continue outside the boxes, of
// the support surface, and those closer to the surface of another object.
std::vector<SurfacePoint> SurfaceOf(const Landmark& landmark, std::span<const SurfacePoint> cloud,
                                    const EstimationContext& context);

// Re-estimates the landmark with these points on its surface. Accepts the new estimate if it fits the points
// within the precision of dense depth and much better than the old one, and fits held-out boxes hardly worse:
// the outline of a vase is not that of a superquadric. Returns whether it was accepted.
bool EstimateWithSurface(Landmark& landmark, std::span<const SurfacePoint> surface,
                         const EstimationContext& context);

// Applies both to all estimated landmarks, largest first. `context`: the part that does not depend on the
// landmark. Returns the ids of the landmarks that changed.
std::vector<int> EstimateWithCloud(std::map<int, Landmark>& landmarks, std::span<const SurfacePoint> cloud,
                                   EstimationContext context);

}  // namespace sqslam
