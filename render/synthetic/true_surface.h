#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <vector>

#include "render/synthetic/scene_description.h"

namespace sqslam {

// A point of a scene's surface, world frame.
struct TruePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // outwards, length 1
};

// Returns the first point of the scene along a ray; empty if there is none.
std::optional<TruePoint> CastRay(const SceneDescription& scene, const Eigen::Vector3d& origin,
                                 const Eigen::Vector3d& direction);

// Returns the surface that the scene's camera sees at these poses (T_world_camera): rays through every 4th
// pixel of every 12th frame, fewer of long or large sequences; one point in each cube of 7 mm.
std::vector<TruePoint> SeenSurface(const SceneDescription& scene, const std::vector<Rigid3d>& poses);

// Writes a binary little-endian PLY with x y z nx ny nz.
void WriteSurface(const std::filesystem::path& path, const std::vector<TruePoint>& points);

}  // namespace sqslam
