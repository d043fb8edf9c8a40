#include "tests/support/board_scene.h"

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace sqslam::testing {
namespace {

constexpr double kDotsPerMm = 4.0;
constexpr int kRays = 3;          // per pixel and direction
constexpr double kMargin = 12.0;  // mm of white paper around the board

cv::Mat Paper(const CalibrationBoard& board) {
  const double width = board.columns * board.square_mm + 2.0 * kMargin;
  const double height = board.rows * board.square_mm + 2.0 * kMargin;
  cv::Mat paper(static_cast<int>(height * kDotsPerMm), static_cast<int>(width * kDotsPerMm), CV_8U,
                cv::Scalar(235));
  for (const BoardArea& part : BoardAreas(board)) {
    const cv::Rect2d& a = part.area;
    const auto dots = [](double mm) { return static_cast<int>(std::lround((mm + kMargin) * kDotsPerMm)); };
    const cv::Point first(dots(a.x), dots(a.y));
    const cv::Point last(dots(a.x + a.width) - 1, dots(a.y + a.height) - 1);
    cv::rectangle(paper, first, last, cv::Scalar(part.black ? 25 : 235), cv::FILLED);
  }
  return paper;
}

}  // namespace

BoardScene::BoardScene(const CalibrationBoard& board, const Camera& camera)
    : camera_(camera), paper_(Paper(board)) {
  for (int y = 0; y < camera.height * kRays; ++y) {
    for (int x = 0; x < camera.width * kRays; ++x) {
      const Eigen::Vector2d pixel((x + 0.5) / kRays - 0.5, (y + 0.5) / kRays - 0.5);
      rays_.push_back(camera.Unproject(camera.Undistort(pixel)).head<2>().cast<float>());
    }
  }
}

cv::Mat BoardScene::Render(const Rigid3d& T_camera_board) const {
  const Eigen::Matrix3d R = T_camera_board.rotation.toRotationMatrix().transpose();
  const Eigen::Vector3d eye = -(R * T_camera_board.translation);
  cv::Mat places(camera_.height * kRays, camera_.width * kRays, CV_32FC2);
  std::size_t i = 0;
  for (int y = 0; y < places.rows; ++y) {
    for (int x = 0; x < places.cols; ++x) {
      const Eigen::Vector3d ray = R * rays_[i++].cast<double>().homogeneous();
      const Eigen::Vector2d hit = (eye - eye.z() / ray.z() * ray).head<2>();
      const Eigen::Vector2f place = (((hit.array() + kMargin) * kDotsPerMm) - 0.5).matrix().cast<float>();
      places.at<cv::Vec2f>(y, x) = {place.x(), place.y()};
    }
  }
  cv::Mat fine;
  cv::remap(paper_, fine, places, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(110));
  cv::Mat gray;
  cv::resize(fine, gray, {camera_.width, camera_.height}, 0.0, 0.0, cv::INTER_AREA);
  cv::Mat bgr;
  cv::cvtColor(gray, bgr, cv::COLOR_GRAY2BGR);
  return bgr;
}

Rigid3d BoardPose(const CalibrationBoard& board, const Camera& camera, int index, double reach) {
  const double width = board.columns * board.square_mm;
  const double height = board.rows * board.square_mm;
  const double turn = 2.39996 * index;  // the golden angle spreads them
  const double lean = 0.15 + 0.4 * std::fmod(0.618 * index, 1.0);
  const Eigen::Quaterniond rotation(
      Eigen::AngleAxisd(lean, Eigen::Vector3d(std::cos(turn), std::sin(turn), 0.0)) *
      Eigen::AngleAxisd(0.3 * std::sin(1.7 * index), Eigen::Vector3d::UnitZ()));
  // About half as wide as the image, in its corners and in its middle by turns. A lens with barrel distortion
  // shows a little more than the pinhole camera.
  const double distance = (1.8 + 0.25 * std::sin(0.9 * index)) * camera.fx * width / camera.width;
  const double visible_width = camera.width / camera.fx * distance;
  const double visible_height = camera.height / camera.fy * distance;
  const int place = index % 5;
  const double off_x = place == 4 ? 0.0 : (place % 2 == 0 ? -0.5 : 0.5) * reach * (visible_width - width);
  const double off_y = place == 4 ? 0.0 : (place < 2 ? -0.5 : 0.5) * reach * (visible_height - height);
  const Eigen::Vector3d middle(0.5 * width, 0.5 * height, 0.0);
  return {rotation, Eigen::Vector3d(off_x, off_y, distance) - rotation * middle};
}

}  // namespace sqslam::testing
