#pragma once

#include <Eigen/Core>
#include <array>

namespace sqslam {

// Pinhole camera with radial-tangential distortion (the model of OpenCV, order k1 k2 p1 p2 k3).
// Pixel centres lie at whole numbers; lengths in pixels.
struct Camera {
  int width = 0;
  int height = 0;
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  std::array<double, 5> distortion{};
  double fps = 30.0;
  double readout_ms = 0.0;  // from the first to the last row (below 0: the last comes first); 0: unknown

  bool HasDistortion() const;

  // The camera matrix.
  Eigen::Matrix3d K() const {
    return (Eigen::Matrix3d() << fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0).finished();
  }

  // True for a pixel within the image's width and height.
  bool InImage(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < width && pixel.y() < height;
  }

  // Pixel without distortion of a point in the camera frame (z > 0).
  Eigen::Vector2d Project(const Eigen::Vector3d& p_camera) const {
    return {fx * p_camera.x() / p_camera.z() + cx, fy * p_camera.y() / p_camera.z() + cy};
  }

  // Pixel as the real lens shows it, of a point in the camera frame (z > 0).
  Eigen::Vector2d ProjectDistorted(const Eigen::Vector3d& p_camera) const;

  // Distorted pixel -> undistorted pixel (same K); fixed-point iteration.
  Eigen::Vector2d Undistort(const Eigen::Vector2d& pixel) const;

  // Viewing ray (z = 1) of an undistorted pixel.
  Eigen::Vector3d Unproject(const Eigen::Vector2d& pixel) const {
    return {(pixel.x() - cx) / fx, (pixel.y() - cy) / fy, 1.0};
  }
};

// The camera of the same images brought to another size.
Camera ResizedCamera(const Camera& camera, int width, int height);

// The camera of the same images turned clockwise by so many quarters. Turned by one or three, rows become
// columns, and the readout time says nothing about them.
Camera TurnedCamera(const Camera& camera, int quarter_turns);

// Angle between the rays of the left and the right border through the principal point's row, without
// distortion; radians.
double HorizontalFieldOfView(const Camera& camera);

}  // namespace sqslam
