#include "render/scene/clip_plane.h"

namespace sqslam {
bool ClipPlane::KeepsSomeOf(const PosedSuperquadric& solid) const {
  return normal.dot(solid.T_map_object.translation) - SupportExtent(solid, normal) <= height;
}

std::optional<ClipPlane> MakeClipPlane(const SceneStyle::Clip& clip, const SceneFocus& focus,
                                       const ViewCamera& camera) {
  if (clip.axis == "none") {
    return std::nullopt;
  }
  ClipPlane plane;
  plane.normal = clip.axis == "x"   ? Eigen::Vector3d(Eigen::Vector3d::UnitX())
                 : clip.axis == "y" ? Eigen::Vector3d(Eigen::Vector3d::UnitY())
                 : clip.axis == "z" ? Eigen::Vector3d(Eigen::Vector3d::UnitZ())
                                    : AxesOf(camera).back;
  plane.height = plane.normal.dot(focus.center) + clip.offset * focus.radius;
  if (clip.flip) {
    plane.normal = -plane.normal;
    plane.height = -plane.height;
  }
  return plane;
}

}  // namespace sqslam
