#include "slam/objects/visibility.h"

#include <cmath>

namespace sqslam {

bool MayBeInView(const PosedSuperquadric& superquadric, const Rigid3d& T_map_camera, const Camera& camera) {
  const Eigen::Vector3d p = T_map_camera.Inverse() * superquadric.T_map_object.translation;
  const double radius = superquadric.shape.half_size.norm();
  const auto beyond = [&](double offset, double edge) {  // the plane offset = edge * z
    return (offset - edge * p.z()) / std::hypot(1.0, edge) > radius;
  };
  return p.z() > 0.0 && !beyond(p.x(), (camera.width - camera.cx) / camera.fx) &&
         !beyond(-p.x(), camera.cx / camera.fx) && !beyond(p.y(), (camera.height - camera.cy) / camera.fy) &&
         !beyond(-p.y(), camera.cy / camera.fy);
}

}  // namespace sqslam
