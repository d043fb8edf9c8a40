#include "slam/objects/gravity.h"

namespace sqslam {

std::optional<SupportPlane> EstimateSupportPlane(std::span<const Eigen::Vector3d>, std::span<const Rigid3d>,
                                                 std::span<const std::vector<Eigen::Vector3d>>,
                                                 const GravityOptions&, std::uint64_t) {
  return std::nullopt;
}

std::optional<double> EstimateSupportHeight(std::span<const Eigen::Vector3d>,
                                            std::span<const std::vector<Eigen::Vector3d>>,
                                            const GravityOptions&) {
  return std::nullopt;
}

Rigid3d UprightTransform(const Eigen::Vector3d& up) {
  return {Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()), Eigen::Vector3d::Zero()};
}

}  // namespace sqslam
