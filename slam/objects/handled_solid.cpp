#include "slam/objects/handled_solid.h"

#include <cmath>

namespace sqslam {

HandledBody::HandledBody(const Eigen::Vector3d& hull, bool handled)
    : half(handled ? hull.y() : hull.x(), hull.y(), hull.z()),
      shift(handled ? hull.y() - hull.x() : 0.0),
      hull_(hull),
      handled_(handled) {}

Eigen::Vector3d HandledBody::ByLogHull(const Eigen::Vector3d& by_log_half, double by_shift) const {
  if (!handled_) {
    return by_log_half;
  }
  return {-by_shift * hull_.x(), by_log_half.x() + by_log_half.y() + by_shift * hull_.y(), by_log_half.z()};
}

HandleSupport::HandleSupport(const Eigen::Vector3d& n, const Eigen::Vector3d& hull) {
  constexpr double kLength = 0.5;  // of the bar, share of the object's height
  by_log_hull = {hull.x() * n.x(), 0.0, kLength * hull.z() * std::abs(n.z())};
  value = by_log_hull.sum();
}

}  // namespace sqslam
