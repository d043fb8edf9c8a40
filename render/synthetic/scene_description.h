#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/superquadric.h"

namespace sqslam {

// Lengths are in metres, in a world frame with z up; angles are in radians (degrees in the YAML).

// The texture of a surface. Patterns: see PaintTexture in textured_mesh.h.
struct TextureDescription {
  std::string pattern = "plaster";
  std::vector<std::array<std::uint8_t, 3>> colors;  // RGB; the first is the background
  std::string title;                                // large text, for patterns that have one
  std::uint64_t seed = 0;
};

// A superquadric with a texture: an object with ground truth (id > 0), or furniture without (id 0).
struct SceneBody {
  std::int32_t id = 0;
  std::string label;
  PosedSuperquadric superquadric;  // T_map_object is T_world_object
  double yaw = 0.0;
  TextureDescription texture;
};

// A textured rectangle: corner + s * edge_u + t * edge_v, s and t in [0, 1]; it faces edge_u x edge_v.
struct ScenePanel {
  Eigen::Vector3d corner = Eigen::Vector3d::Zero();
  Eigen::Vector3d edge_u = Eigen::Vector3d::UnitX();
  Eigen::Vector3d edge_v = Eigen::Vector3d::UnitY();
  double shading_step = 0.05;  // distance between the points at which light is computed
  TextureDescription texture;
};

// A rectangular lamp or window: center + s * half_u + t * half_v, s and t in [-1, 1].
struct SceneLight {
  Eigen::Vector3d center = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d half_u = Eigen::Vector3d::UnitX();
  Eigen::Vector3d half_v = Eigen::Vector3d::UnitY();
  Eigen::Vector3d rgb = Eigen::Vector3d::Ones();  // radiance, relative
};

// A control point of the camera path.
struct SceneWaypoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d look_at = Eigen::Vector3d::UnitX();
};

struct SceneDescription {
  std::string name;
  int frames = 240;
  Camera camera;
  std::vector<SceneBody> bodies;
  std::vector<ScenePanel> panels;
  std::vector<SceneLight> lights;
  Eigen::Vector3d ambient = Eigen::Vector3d::Constant(0.3);  // light from everywhere, far from other bodies
  std::vector<SceneWaypoint> waypoints;
  double tremor_position = 0.002;  // metres; amplitude of hand shake
  double tremor_angle = 0.004;     // radians
};

// Reads a scene. Throws InputError that names the file, the position in it and what was expected.
SceneDescription ReadScene(const std::filesystem::path& path);

}  // namespace sqslam
