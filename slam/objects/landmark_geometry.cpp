#include "slam/objects/landmark_geometry.h"

#include <algorithm>
#include <cmath>

#include "slam/objects/superquadric_jet.h"

namespace sqslam {
namespace {

// Smallest and largest u with the plane through the camera centre n = (s, 0, -u) (axis 0) or (0, s, -u) (axis
// 1) touching the solid: solves n . c = h(n) by bisection; the silhouette's extreme is where the plane turns
// tangent.
double SilhouetteExtreme(const PosedSuperquadric& superquadric, const Rigid3d& T_camera_object, int axis,
                         double sign) {
  const Superquadric& shape = superquadric.shape;
  const Eigen::Vector3d centre = T_camera_object.translation;
  const Eigen::Matrix3d R_object_camera = T_camera_object.RotationMatrix().transpose();
  const auto beyond = [&](double u) {
    // Signed reach of the solid beyond the plane x = u z: max over the solid of sign * (x - u z).
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    normal[axis] = sign;
    normal[2] = -sign * u;
    const Eigen::Vector3d n = R_object_camera * normal;
    return normal.dot(centre) + jet::SupportFunction(shape.half_size.data(), shape.e1, shape.e2, n.data());
  };
  const double middle = centre[axis] / centre.z();
  double inside = middle;
  double outside = middle + sign * 0.1;
  for (int i = 0; i < 20 && beyond(outside) > 0.0; ++i) {
    inside = outside;
    outside = middle + (outside - middle) * 2.0;
  }
  for (int i = 0; i < 24; ++i) {
    const double half = 0.5 * (inside + outside);
    (beyond(half) > 0.0 ? inside : outside) = half;
  }
  return 0.5 * (inside + outside);
}

// Whether the boxes along the map's axes around the two are apart.
bool AreFarApart(const PosedSuperquadric& a, const PosedSuperquadric& b) {
  const Eigen::Vector3d reach_a = a.T_map_object.RotationMatrix().cwiseAbs() * a.shape.half_size;
  const Eigen::Vector3d reach_b = b.T_map_object.RotationMatrix().cwiseAbs() * b.shape.half_size;
  const Eigen::Vector3d distance = (a.T_map_object.translation - b.T_map_object.translation).cwiseAbs();
  return ((distance - reach_a - reach_b).array() > 0.0).any();
}

}  // namespace

std::optional<Box2d> ProjectToBox(const PosedSuperquadric& superquadric, const Rigid3d& T_map_camera,
                                  const Camera& camera) {
  const Rigid3d T_camera_object = T_map_camera.Inverse() * superquadric.T_map_object;
  const Eigen::Vector3d forward = T_camera_object.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  const Superquadric& shape = superquadric.shape;
  const double reach = jet::SupportFunction(shape.half_size.data(), shape.e1, shape.e2, forward.data());
  if (T_camera_object.translation.z() - reach <= 1e-6) {
    return std::nullopt;
  }
  const double left = camera.fx * SilhouetteExtreme(superquadric, T_camera_object, 0, -1.0) + camera.cx;
  const double right = camera.fx * SilhouetteExtreme(superquadric, T_camera_object, 0, 1.0) + camera.cx;
  const double top = camera.fy * SilhouetteExtreme(superquadric, T_camera_object, 1, -1.0) + camera.cy;
  const double bottom = camera.fy * SilhouetteExtreme(superquadric, T_camera_object, 1, 1.0) + camera.cy;
  return Box2d{left, top, right - left, bottom - top};
}

Box2d ClipToImage(const Box2d& box, const Camera& camera) {
  const double left = std::clamp(box.x, 0.0, static_cast<double>(camera.width));
  const double top = std::clamp(box.y, 0.0, static_cast<double>(camera.height));
  const double right = std::clamp(box.x + box.width, 0.0, static_cast<double>(camera.width));
  const double bottom = std::clamp(box.y + box.height, 0.0, static_cast<double>(camera.height));
  return {left, top, right - left, bottom - top};
}

Box2d UndistortBox(const Box2d& box, const Camera& camera) {
  if (!camera.HasDistortion()) {
    return box;
  }
  const Eigen::Vector2d c = box.Center();
  const double left = camera.Undistort({box.x, c.y()}).x();
  const double right = camera.Undistort({box.x + box.width, c.y()}).x();
  const double top = camera.Undistort({c.x(), box.y}).y();
  const double bottom = camera.Undistort({c.x(), box.y + box.height}).y();
  return {left, top, right - left, bottom - top};
}

double OverlapOfSmaller(const PosedSuperquadric& a, const PosedSuperquadric& b, int samples) {
  const bool a_smaller = a.shape.Volume() <= b.shape.Volume();
  const PosedSuperquadric& small = a_smaller ? a : b;
  const PosedSuperquadric& large = a_smaller ? b : a;
  if (AreFarApart(a, b)) {
    return 0.0;
  }
  const Rigid3d T_large_small = large.T_map_object.Inverse() * small.T_map_object;
  int inside_small = 0;
  int inside_both = 0;
  for (int i = 0; i < samples * samples * samples; ++i) {
    const Eigen::Vector3d cell(i % samples, (i / samples) % samples, i / (samples * samples));
    const Eigen::Vector3d unit = (cell.array() + 0.5) * (2.0 / samples) - 1.0;
    const Eigen::Vector3d p = unit.cwiseProduct(small.shape.half_size);
    if (small.shape.RadialScale(p) <= 1.0) {
      ++inside_small;
      inside_both += large.shape.RadialScale(T_large_small * p) <= 1.0 ? 1 : 0;
    }
  }
  return inside_small > 0 ? static_cast<double>(inside_both) / inside_small : 0.0;
}

}  // namespace sqslam
