#include "tests/support/textured_world.h"

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace sqslam::testing {
namespace {

// Random rectangles of many sizes over blurred noise: corners at every scale.
cv::Mat MakeTexture(int width, int height, std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat texture(height, width, CV_8UC3);
  random.fill(texture, cv::RNG::UNIFORM, 60, 200);
  cv::GaussianBlur(texture, texture, {}, 2.0);
  const int count = width * height / 600;
  for (int i = 0; i < count; ++i) {
    const int size = static_cast<int>(4.0 * std::exp(random.uniform(0.0, 2.3)));
    const cv::Rect rect(random.uniform(0, width), random.uniform(0, height), size,
                        random.uniform(4, size + 5));
    const cv::Scalar color(random.uniform(0, 255), random.uniform(0, 255), random.uniform(0, 255));
    cv::rectangle(texture, rect, color, cv::FILLED);
  }
  cv::GaussianBlur(texture, texture, {}, 0.8);
  return texture;
}

}  // namespace

TexturedWorld::TexturedWorld(const Camera& pinhole) : camera_(pinhole) {
  panels_ = {{{-6.0, -5.0, 4.0}, {12.0, 0.0, 0.0}, {0.0, 10.0, 0.0}, MakeTexture(1600, 1300, 11)},
             {{-1.9, -0.6, 2.4}, {1.2, 0.0, 0.3}, {0.0, 1.3, 0.0}, MakeTexture(400, 430, 12)},
             {{0.4, -0.9, 2.8}, {1.1, 0.0, -0.4}, {0.0, 1.2, 0.0}, MakeTexture(380, 420, 13)},
             {{-0.5, 0.2, 1.8}, {0.8, 0.0, 0.1}, {0.0, 0.6, -0.1}, MakeTexture(360, 260, 14)}};
}

Frame TexturedWorld::Render(std::int64_t index, const Rigid3d& T_map_camera) const {
  Frame frame;
  frame.index = index;
  frame.timestamp = static_cast<double>(index) / 30.0;
  frame.bgr = cv::Mat(camera_.height, camera_.width, CV_8UC3, cv::Scalar::all(90));
  const Rigid3d T_camera_map = T_map_camera.Inverse();
  for (const Panel& panel : panels_) {
    std::vector<cv::Point2f> from{
        {0.0F, 0.0F},
        {static_cast<float>(panel.texture.cols), 0.0F},
        {static_cast<float>(panel.texture.cols), static_cast<float>(panel.texture.rows)},
        {0.0F, static_cast<float>(panel.texture.rows)}};
    std::vector<cv::Point2f> to;
    for (const Eigen::Vector3d& corner : {panel.corner, Eigen::Vector3d(panel.corner + panel.right),
                                          Eigen::Vector3d(panel.corner + panel.right + panel.down),
                                          Eigen::Vector3d(panel.corner + panel.down)}) {
      const Eigen::Vector2d pixel = camera_.Project(T_camera_map * corner);
      to.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
    }
    cv::warpPerspective(panel.texture, frame.bgr, cv::getPerspectiveTransform(from, to), frame.bgr.size(),
                        cv::INTER_AREA, cv::BORDER_TRANSPARENT);
  }
  cv::cvtColor(frame.bgr, frame.gray, cv::COLOR_BGR2GRAY);
  return frame;
}

ThroughLens::ThroughLens(const Camera& lens, const Camera& pinhole)
    : from_(lens.height, lens.width, CV_32FC2) {
  for (int row = 0; row < lens.height; ++row) {
    for (int column = 0; column < lens.width; ++column) {
      const Eigen::Vector2d pixel = pinhole.Project(lens.Unproject(lens.Undistort({column, row})));
      from_.at<cv::Vec2f>(row, column) = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
    }
  }
}

Frame ThroughLens::operator()(const Frame& frame) const {
  Frame seen = frame;
  cv::remap(frame.gray, seen.gray, from_, cv::noArray(), cv::INTER_LINEAR);
  cv::remap(frame.bgr, seen.bgr, from_, cv::noArray(), cv::INTER_LINEAR);
  return seen;
}

std::vector<Rigid3d> HandHeldPath(int count) {
  std::vector<Rigid3d> path;
  for (int i = 0; i < count; ++i) {
    const double t = static_cast<double>(i);
    Rigid3d T_map_camera;
    T_map_camera.translation = {0.5 * std::sin(0.03 * t), 0.06 * std::sin(0.05 * t), 0.004 * t};
    T_map_camera.rotation = Eigen::AngleAxisd(0.12 * std::sin(0.02 * t), Eigen::Vector3d::UnitY()) *
                            Eigen::AngleAxisd(0.03 * std::sin(0.04 * t), Eigen::Vector3d::UnitX());
    path.push_back(T_map_camera);
  }
  return path;
}

double AlignedError(const std::vector<Eigen::Vector3d>& estimate, const std::vector<Eigen::Vector3d>& truth) {
  Eigen::Matrix3Xd a(3, estimate.size());
  Eigen::Matrix3Xd b(3, truth.size());
  for (Eigen::Index i = 0; i < a.cols(); ++i) {
    a.col(i) = estimate[static_cast<std::size_t>(i)];
    b.col(i) = truth[static_cast<std::size_t>(i)];
  }
  const Eigen::Matrix4d S = Eigen::umeyama(a, b, true);
  const Eigen::Matrix3Xd aligned = (S.topLeftCorner<3, 3>() * a).colwise() + S.topRightCorner<3, 1>();
  return std::sqrt((aligned - b).colwise().squaredNorm().mean());
}

}  // namespace sqslam::testing
