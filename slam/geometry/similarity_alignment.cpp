#include "slam/geometry/similarity_alignment.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "slam/geometry/eigen_system.h"

namespace sqslam {
namespace {

// A rotation needs two directions of spread. Below this ratio of the second to the first standard deviation
// the points are a line, given the noise of any trajectory.
constexpr double kMinSpreadRatio = 1e-4;

bool SpansAPlane(const Eigen::Matrix3Xd& points) {
  const Eigen::Vector3d mean = points.rowwise().mean();
  const Eigen::Matrix3Xd centered = points.colwise() - mean;
  const Eigen::Vector3d variance = EigenSystemOf(Eigen::Matrix3d(centered * centered.transpose())).values;
  // NaN fails both conditions; the second one rejects points that differ by rounding only.
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

std::optional<Sim3d> AlignPoses(const std::vector<Rigid3d>& source, const std::vector<Rigid3d>& target) {
  constexpr int kRounds = 10;
  constexpr double kMinError = 1e-12;  // mean square, for exact poses
  const auto positions = [](const std::vector<Rigid3d>& poses) {
    std::vector<Eigen::Vector3d> all(poses.size());
    std::ranges::transform(poses, all.begin(), &Rigid3d::translation);
    return all;
  };
  std::optional<Sim3d> S = AlignSimilarity(positions(source), positions(target));
  if (!S) {
    return std::nullopt;
  }
  const auto count = static_cast<double>(source.size());
  Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero();  // means
  for (std::size_t i = 0; i < source.size(); ++i) {
    from += source[i].translation / count;
    to += target[i].translation / count;
  }
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d moved = Eigen::Matrix3d::Zero(), turned = Eigen::Matrix3d::Zero();
    double position_error = kMinError, turn_error = kMinError, extent = 0.0;
    for (std::size_t i = 0; i < source.size(); ++i) {
      const Eigen::Vector3d a = source[i].translation - from, b = target[i].translation - to;
      const Eigen::Matrix3d A(source[i].rotation), B(target[i].rotation);
      moved += b * a.transpose();
      turned += B * A.transpose();
      extent += a.squaredNorm();
      position_error += (b - S->scale * (S->rotation * a)).squaredNorm();
      turn_error += (B - S->rotation.toRotationMatrix() * A).squaredNorm();  // twice the squared angle
    }
    // The rotation of the weighted orthogonal Procrustes problem, and the scale that fits it.
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(S->scale / position_error * moved + turned / turn_error,
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    const Eigen::Matrix3d R =
        svd.matrixU() * Eigen::Vector3d(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
    S->rotation = Eigen::Quaterniond(R);
    S->scale = (R.transpose() * moved).trace() / extent;
  }
  S->translation = to - S->scale * (S->rotation * from);
  return S->scale > 0.0 ? S : std::nullopt;
}

}  // namespace sqslam
