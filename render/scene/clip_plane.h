#pragma once

#include <Eigen/Core>
#include <optional>

#include "render/camera/camera_path.h"
#include "render/camera/scene_framing.h"
#include "render/scene/style.h"
#include "slam/geometry/superquadric.h"

namespace sqslam {

// Cuts away the part of a scene with normal . p > height, map frame.
struct ClipPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit length
  double height = 0.0;                                // map units

  bool Keeps(const Eigen::Vector3d& p_map) const { return normal.dot(p_map) <= height; }
  bool KeepsSomeOf(const PosedSuperquadric& solid) const {
    return normal.dot(solid.T_map_object.translation) - SupportExtent(solid, normal) <= height;
  }
};

// Returns the plane that a style asks for, nullopt for none. "view" turns with the camera.
inline std::optional<ClipPlane> MakeClipPlane(const SceneStyle::Clip& clip, const SceneFocus& focus,
                                              const ViewCamera& camera) {
  if (clip.axis == ClipAxis::kNone) {
    return std::nullopt;
  }
  ClipPlane plane;
  plane.normal = clip.axis == ClipAxis::kView ? AxesOf(camera).back
                                              : Eigen::Vector3d::Unit(static_cast<int>(clip.axis) - 1).eval();
  plane.height = plane.normal.dot(focus.center) + clip.offset * focus.radius;
  if (clip.flip) {
    plane.normal = -plane.normal;
    plane.height = -plane.height;
  }
  return plane;
}

}  // namespace sqslam
