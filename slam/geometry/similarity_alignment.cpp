#include "slam/geometry/similarity_alignment.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

namespace sqslam {
namespace {

// A rotation needs two directions of spread. Below this ratio of the second to the first standard deviation
// the points are a line, given the noise of any trajectory.
constexpr double kMinSpreadRatio = 1e-4;

bool SpansAPlane(const Eigen::Matrix3Xd& points) {
  const Eigen::Vector3d mean = points.rowwise().mean();
  const Eigen::Matrix3Xd centered = points.colwise() - mean;
  const Eigen::Vector3d variance = EigenSystemOf(Eigen::Matrix3d(centered * centered.transpose())).values;
  // Written so that NaN fails; the second condition rejects points that differ by rounding only.
  return variance[1] > kMinSpreadRatio * kMinSpreadRatio * variance[2] &&
         variance[2] > 1e-24 * (1.0 + points.squaredNorm());
}

}  // namespace

std::optional<Sim3d> AlignSimilarity(const std::vector<Eigen::Vector3d>& source,
                                     const std::vector<Eigen::Vector3d>& target) {
  if (source.size() != target.size() || source.size() < 3) {
    return std::nullopt;
  }
  const auto count = static_cast<Eigen::Index>(source.size());
  const Eigen::Matrix3Xd from = Eigen::Map<const Eigen::Matrix3Xd>(source.front().data(), 3, count);
  const Eigen::Matrix3Xd to = Eigen::Map<const Eigen::Matrix3Xd>(target.front().data(), 3, count);
  if (!SpansAPlane(from) || !SpansAPlane(to)) {
    return std::nullopt;
  }
  const Eigen::Matrix4d transform = Eigen::umeyama(from, to, true);
  const double scale = std::cbrt(transform.topLeftCorner<3, 3>().determinant());
  if (!std::isfinite(scale) || scale <= 0.0) {
    return std::nullopt;
  }
  const Eigen::Matrix3d rotation = transform.topLeftCorner<3, 3>() / scale;
  return Sim3d{scale, Eigen::Quaterniond(rotation).normalized(), transform.topRightCorner<3, 1>()};
}

}  // namespace sqslam
