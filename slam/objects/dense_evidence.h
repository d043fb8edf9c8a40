#pragma once

#include <Eigen/Core>
#include <map>
#include <span>
#include <vector>

#include "slam/objects/landmark.h"
#include "slam/objects/landmark_estimation.h"

namespace sqslam {

// A point of a surface that dense depth shows, map frame.
struct SurfacePoint {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // unit vector towards the cameras
};

// Points of the cloud that are the landmark's: within nearly all of its boxes and near its estimate; not of a
// plane that goes on outside of the boxes, not of the surface that it stands on, nor nearer to another
// object's surface; in pieces of some size.
std::vector<SurfacePoint> SurfaceOf(const Landmark& landmark, std::span<const SurfacePoint> cloud,
                                    const EstimationContext& context);

// Estimates the landmark again with these points on its surface. The new estimate is taken where it explains
// the points within the precision of dense depth, much better than the old one does, and boxes that neither
// was fitted to hardly worse: the outline of a vase is no superquadric's. Returns whether it was.
bool EstimateWithSurface(Landmark& landmark, std::span<const SurfacePoint> surface,
                         const EstimationContext& context);

// Both for all landmarks that are estimated, the largest first. `context`: what does not depend on the
// landmark. Returns the ids of those that were changed.
std::vector<int> EstimateWithCloud(std::map<int, Landmark>& landmarks, std::span<const SurfacePoint> cloud,
                                   EstimationContext context);

}  // namespace sqslam
