#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "slam/geometry/rigid3.h"
#include "slam/objects/object_options.h"

namespace sqslam {

// The up direction and the plane that the objects stand on, in the map frame: up . p = height on the plane.
struct SupportPlane {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  // unit, against gravity
  double height = 0.0;                            // map units
  double confidence = 0.0;                        // in [0, 1]: support, flatness, agreement with the cameras
  int inliers = 0;                                // map points on the plane
};

// Finds the dominant plane under the objects. `points`: map points (map frame). `poses`: keyframe poses
// T_map_camera, held upright within options.max_angle_deg. `object_points` (may be empty): the point sets of
// objects, each of which should end at or above the plane. `vertical` (may be empty): the direction of
// vertical edges, unit, map frame: planes across it count more. Returns nullopt if no plane is dominant.
std::optional<SupportPlane> EstimateSupportPlane(std::span<const Eigen::Vector3d> points,
                                                 std::span<const Rigid3d> poses,
                                                 std::span<const std::vector<Eigen::Vector3d>> object_points,
                                                 const GravityOptions& options, std::uint64_t seed,
                                                 const std::optional<Eigen::Vector3d>& vertical = {});

// Estimates the height of the support plane if the map's z axis is up: the level that most points share.
std::optional<double> EstimateSupportHeight(std::span<const Eigen::Vector3d> points,
                                            std::span<const std::vector<Eigen::Vector3d>> object_points,
                                            const GravityOptions& options);

// Rotation of the map that turns `up` into +z and keeps the heading of the first camera: p_new = T_new_old *
// p_old.
Rigid3d UprightTransform(const Eigen::Vector3d& up);

}  // namespace sqslam
