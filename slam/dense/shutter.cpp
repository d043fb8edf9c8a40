#include "slam/dense/shutter.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "slam/dense/view_choice.h"
#include "slam/tracking/rolling_shutter.h"

namespace sqslam {
namespace {

// Inverse depth over an image: value at the centre, slopes over width and height, and lower bound.
struct InverseDepthPlane {
  Eigen::Vector3d coefficients;
  double least = 0.0;

  double At(double u, double v) const {
    return std::max(least, coefficients.dot(Eigen::Vector3d(1.0, u - 0.5, v - 0.5)));
  }
};

std::optional<InverseDepthPlane> PlaneThrough(const std::vector<Eigen::Vector3d>& in_view,
                                              const Camera& camera, const Rigid3d& T_map_camera) {
  constexpr std::size_t kEnough = 10;
  constexpr double kDamping = 0.01;  // of the slopes, which few points determine poorly
  if (in_view.size() < kEnough) {
    return std::nullopt;
  }
  const Rigid3d T_camera_map = T_map_camera.Inverse();
  Eigen::Matrix3d A =
      kDamping * static_cast<double>(in_view.size()) * Eigen::Vector3d(0.0, 1.0, 1.0).asDiagonal();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p_map : in_view) {
    const Eigen::Vector3d p = T_camera_map * p_map;
    const Eigen::Vector2d pixel = camera.Project(p);
    const Eigen::Vector3d row(1.0, pixel.x() / camera.width - 0.5, pixel.y() / camera.height - 0.5);
    A += row * row.transpose();
    b += row / p.z();
  }
  return InverseDepthPlane{A.ldlt().solve(b), 0.7 / (T_camera_map * in_view.back()).z()};  // farthest last
}

}  // namespace

ShutterCorrection::ShutterCorrection(const Camera& camera, double readout, const Sequence& sequence,
                                     PosesByFrame poses, std::vector<Eigen::Vector3d> points)
    : camera_(camera), readout_(readout), poses_(std::move(poses)), points_(std::move(points)) {
  for (const SequenceFrame& frame : sequence.frames) {
    timestamps_.push_back(frame.timestamp);
  }
}

cv::Mat ShutterCorrection::Apply(std::int64_t frame, const cv::Mat& image) const {
  constexpr std::size_t kSamples = 300;  // map points
  const auto middle = poses_.find(frame);
  if (readout_ == 0.0 || middle == poses_.end() || image.empty()) {
    return image;
  }
  const auto before = poses_.contains(frame - 1) ? poses_.find(frame - 1) : middle;
  const auto after = poses_.contains(frame + 1) ? poses_.find(frame + 1) : middle;
  const auto plane =
      PlaneThrough(PointsInView(points_, camera_, middle->second, kSamples), camera_, middle->second);
  if (before == after || !plane) {
    return image;
  }
  const double seconds = timestamps_[static_cast<std::size_t>(after->first)] -
                         timestamps_[static_cast<std::size_t>(before->first)];
  const CameraMotion motion =
      CameraMotion::Between(before->second.Inverse(), after->second.Inverse(), seconds);
  cv::Mat places_x(camera_.height, camera_.width, CV_32F);
  cv::Mat places_y(camera_.height, camera_.width, CV_32F);
  for (int y = 0; y < camera_.height; ++y) {
    for (int x = 0; x < camera_.width; ++x) {
      const double inverse =
          plane->At(static_cast<double>(x) / camera_.width, static_cast<double>(y) / camera_.height);
      const Eigen::Vector2d flow = motion.InImage(
          camera_, camera_.Unproject({static_cast<double>(x), static_cast<double>(y)}) / inverse);
      const auto delay = [this](double row) { return ((row + 0.5) / camera_.height - 0.5) * readout_; };
      const double taken = delay(y + delay(y) * flow.y());  // in the row where the point was seen
      places_x.at<float>(y, x) = static_cast<float>(x + taken * flow.x());
      places_y.at<float>(y, x) = static_cast<float>(y + taken * flow.y());
    }
  }
  cv::Mat corrected;
  cv::remap(image, corrected, places_x, places_y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return corrected;
}

}  // namespace sqslam
