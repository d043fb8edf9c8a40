#include "render/clip_plane.h"

#include <cmath>

namespace sqslam {
namespace {

// How far a superquadric at the origin reaches along a direction. Its surface is the unit sphere of nested
// norms with the exponents 2 / e, so that this is the dual norm, with the exponents 2 / (2 - e).
double Reach(const Superquadric& shape, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d d = direction.cwiseProduct(shape.half_size).cwiseAbs();
  const double largest = d.maxCoeff();  // taken out: powers of small numbers vanish
  if (largest <= 0.0) {
    return 0.0;
  }
  const double across = 2.0 / (2.0 - shape.e2);
  const double along = 2.0 / (2.0 - shape.e1);
  const double level =
      std::pow(std::pow(d.x() / largest, across) + std::pow(d.y() / largest, across), along / across);
  return largest * std::pow(level + std::pow(d.z() / largest, along), 1.0 / along);
}

}  // namespace

bool ClipPlane::KeepsSomeOf(const PosedSuperquadric& solid) const {
  const Rigid3d& pose = solid.T_map_object;
  return normal.dot(pose.translation) - Reach(solid.shape, pose.rotation.conjugate() * normal) <= height;
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
