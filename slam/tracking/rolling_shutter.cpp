#include "slam/tracking/rolling_shutter.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "slam/estimation/reprojection_error.h"
#include "slam/util/statistics.h"

namespace sqslam {
namespace {

// Mean inverse depth around a pixel, shrunk towards the median of the image if few points are near.
class InverseDepths {
 public:
  InverseDepths(const Camera& camera, const FrameFeatures& features,
                std::span<const ShutterObservation> observations)
      : camera_(camera) {
    std::vector<double> all;
    for (const ShutterObservation& o : observations) {
      const double inverse = 1.0 / o.p_camera.z();
      all.push_back(inverse);
      Cell& cell = cells_[CellOf(features.keypoints[o.keypoint].pixel)];
      cell.sum += inverse;
      cell.count += 1.0;
    }
    median_ = UpperMedian(std::move(all));
  }
  double At(const Eigen::Vector2d& pixel) const {
    const Cell& cell = cells_[CellOf(pixel)];
    return (cell.sum + median_) / (cell.count + 1.0);
  }

 private:
  static constexpr int kColumns = 8;
  static constexpr int kRows = 6;
  struct Cell {
    double sum = 0.0;
    double count = 0.0;
  };
  std::size_t CellOf(const Eigen::Vector2d& pixel) const {
    const int x = std::clamp(static_cast<int>(pixel.x() * kColumns / camera_.width), 0, kColumns - 1);
    const int y = std::clamp(static_cast<int>(pixel.y() * kRows / camera_.height), 0, kRows - 1);
    return static_cast<std::size_t>(y * kColumns + x);
  }

  const Camera& camera_;
  std::array<Cell, kColumns * kRows> cells_{};
  double median_ = 0.0;
};

}  // namespace

CameraMotion CameraMotion::Between(const Rigid3d& T_last_map, const Rigid3d& T_current_map, double seconds) {
  const Rigid3d T_current_last = T_current_map * T_last_map.Inverse();
  Eigen::AngleAxisd turn(T_current_last.rotation);
  if (turn.angle() > std::numbers::pi) {
    turn.angle() -= 2.0 * std::numbers::pi;
  }
  return {turn.angle() / seconds * turn.axis(), T_current_last.translation / seconds};
}

Eigen::Vector2d CameraMotion::InImage(const Camera& camera, const Eigen::Vector3d& p_camera) const {
  return ProjectionJacobian(camera, p_camera) * (turn.cross(p_camera) + velocity);
}

RollingShutter::RollingShutter(const Camera& camera, const RollingShutterOptions& options)
    : camera_(camera),
      options_(options),
      known_readout_(1e-3 * (options.readout_ms != 0.0 ? options.readout_ms : camera.readout_ms)) {}

double RollingShutter::RowDelay(double raw_row) const { return (raw_row + 0.5) / camera_.height - 0.5; }

double RollingShutter::Readout() const {
  constexpr double kMaxDeviation = 1.0e-3;  // s, standard deviation of an estimate that is used
  constexpr double kMinReadout = 5.0e-3;    // s, a shorter time counts as a global shutter
  const bool learnt = options_.estimate && information_ > 1.0 / (kMaxDeviation * kMaxDeviation);
  const double readout = learnt ? evidence_ / information_ : known_readout_;
  return std::abs(readout) >= kMinReadout ? readout : 0.0;
}

std::optional<CameraMotion> RollingShutter::Motion(const Rigid3d& T_last_map, const Rigid3d& T_current_map,
                                                   double seconds) const {
  constexpr double kMaxInterval = 0.2;      // s
  constexpr double kMinInterval = 2e-3;     // s
  constexpr double kMinReadoutShare = 0.5;  // with a margin: no image begins before the last one is read
  const double shortest = std::max(kMinInterval, kMinReadoutShare * std::abs(Readout()));
  return seconds >= shortest && seconds <= kMaxInterval
             ? std::optional(CameraMotion::Between(T_last_map, T_current_map, seconds))
             : std::nullopt;
}

FrameFeaturesPtr RollingShutter::Correct(const FrameFeaturesPtr& features, const CameraMotion& motion,
                                         std::span<const ShutterObservation> observations) const {
  const double readout = Readout();
  if (readout == 0.0 || observations.empty()) {
    return features;
  }
  const InverseDepths inverse_depths(camera_, *features, observations);
  std::vector<double> depths(features->Size(), 0.0);
  for (const ShutterObservation& o : observations) {
    depths[o.keypoint] = o.p_camera.z();
  }
  auto corrected = std::make_shared<FrameFeatures>(*features);
  for (std::size_t i = 0; i < corrected->Size(); ++i) {
    Keypoint& keypoint = corrected->keypoints[i];
    const double depth = depths[i] > 0.0 ? depths[i] : 1.0 / inverse_depths.At(keypoint.pixel);
    const Eigen::Vector3d p_camera = depth * camera_.Unproject(keypoint.pixel);
    const Eigen::Vector2d uncorrected = keypoint.pixel;
    keypoint.pixel -= readout * RowDelay(keypoint.raw_pixel.y()) * motion.InImage(camera_, p_camera);
    if (!IsInReach(keypoint.pixel)) {
      keypoint.pixel = uncorrected;
    }
  }
  corrected->grid = KeypointGrid(corrected->keypoints, camera_.width, camera_.height);
  return corrected;
}

Box2d RollingShutter::Correct(const Box2d& box, const CameraMotion& motion, double depth) const {
  constexpr double kFarDepth = 1e6;  // map units
  return MoveEdges(box, [&](const Eigen::Vector2d& pixel) -> Eigen::Vector2d {
    const Eigen::Vector3d p_camera =
        (depth > 0.0 ? depth : kFarDepth) * camera_.Unproject(camera_.Undistort(pixel));
    return pixel - Readout() * RowDelay(pixel.y()) * motion.InImage(camera_, p_camera);
  });
}

void RollingShutter::Learn(const FrameFeatures& features, const CameraMotion& motion,
                           std::span<const ShutterObservation> observations) {
  // Caps the information of past frames at that of one measurement with this standard deviation (s): new
  // frames replace old ones, but nothing is forgotten while the camera stands still.
  constexpr double kMinDeviation = 0.7e-3;
  constexpr std::size_t kMinPoints = 30;
  if (!options_.estimate || observations.size() < kMinPoints) {
    return;
  }
  Matrix6d poses = Matrix6d::Zero();
  Vector6d pose_readout = Vector6d::Zero();
  Vector6d pose_residual = Vector6d::Zero();
  double readout_readout = 0.0;
  double readout_residual = 0.0;
  for (const ShutterObservation& o : observations) {
    const Keypoint& keypoint = features.keypoints[o.keypoint];
    const Eigen::Vector2d residual = camera_.Undistort(keypoint.raw_pixel) - camera_.Project(o.p_camera);
    const Eigen::Matrix<double, 2, 3> d_point = ProjectionJacobian(camera_, o.p_camera);
    Eigen::Matrix<double, 2, 6> d_pose;
    d_pose.leftCols<3>() = -d_point * Skew(o.p_camera);
    d_pose.rightCols<3>() = d_point;
    const Eigen::Vector2d d_readout = RowDelay(keypoint.raw_pixel.y()) * motion.InImage(camera_, o.p_camera);
    poses.noalias() += d_pose.transpose() * d_pose / o.variance;
    pose_readout.noalias() += d_pose.transpose() * d_readout / o.variance;
    pose_residual.noalias() += d_pose.transpose() * residual / o.variance;
    readout_readout += d_readout.squaredNorm() / o.variance;
    readout_residual += d_readout.dot(residual) / o.variance;
  }
  poses.diagonal() *= 1.0 + 1e-9;
  const Vector6d taken_up = poses.ldlt().solve(pose_readout);
  const double information = readout_readout - taken_up.dot(pose_readout);
  const double evidence = readout_residual - taken_up.dot(pose_residual);
  if (std::isfinite(information) && std::isfinite(evidence)) {
    information_ += std::max(0.0, information);
    evidence_ += evidence;
    const double kept =
        information_ > 0.0 ? std::min(1.0, 1.0 / (kMinDeviation * kMinDeviation * information_)) : 1.0;
    information_ *= kept;
    evidence_ *= kept;
  }
}

}  // namespace sqslam
