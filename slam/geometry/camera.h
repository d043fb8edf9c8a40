#pragma once

#include <Eigen/Core>
#include <array>

#include "slam/geometry/lens.h"

namespace sqslam {

// Pinhole camera with lens distortion. Pixel centres have integer coordinates; lengths in pixels.
//
// Undistorted pixels exist for rays with z > 0 only: a fisheye lens is used up to 85 degrees off its axis,
// and rays beyond are taken to be at 85 degrees.
struct Camera {
  int width = 0;
  int height = 0;
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  LensCoefficients<double> distortion{};
  double fps = 30.0;
  double readout_ms = 0.0;  // from the first to the last row (negative: last row first); 0: unknown
  LensModel lens = LensModel::kRadialTangential;

  bool HasDistortion() const;
  Camera WithoutDistortion() const;  // with the same K

  Eigen::Matrix3d K() const {
    return (Eigen::Matrix3d() << fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0).finished();
  }

  // Returns true if a pixel is inside the image.
  bool InImage(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < width && pixel.y() < height;
  }

  // Returns true if an undistorted pixel is inside the image: the distorted image of a fisheye lens, the
  // undistorted one otherwise.
  bool Shows(const Eigen::Vector2d& pixel) const;

  // Returns left, top, right and bottom of the undistorted pixels for which Shows() is true.
  std::array<double, 4> ShownBounds() const;

  // Projects a point in the camera frame (z > 0) to its undistorted pixel.
  Eigen::Vector2d Project(const Eigen::Vector3d& p_camera) const {
    return {fx * p_camera.x() / p_camera.z() + cx, fy * p_camera.y() / p_camera.z() + cy};
  }

  // Projects a point in the camera frame (z > 0) to its distorted pixel.
  Eigen::Vector2d ProjectDistorted(const Eigen::Vector3d& p_camera) const;

  // Returns the undistorted pixel (same K) of a distorted one, by iteration.
  Eigen::Vector2d Undistort(const Eigen::Vector2d& pixel) const;

  // Returns the viewing ray (z = 1) of an undistorted pixel.
  Eigen::Vector3d Unproject(const Eigen::Vector2d& pixel) const {
    return {(pixel.x() - cx) / fx, (pixel.y() - cy) / fy, 1.0};
  }
};

// Returns the camera of the same images resized to another size.
Camera ResizedCamera(const Camera& camera, int width, int height);

// Returns the camera of the same images rotated clockwise by quarter turns. For an odd number rows become
// columns, and the readout time is unknown.
Camera RotatedCamera(const Camera& camera, int quarter_turns);

// Returns the angle between the rays of the left and the right border in the principal point's row, with all
// coefficients of the lens zero; radians.
double HorizontalFieldOfView(const Camera& camera);

}  // namespace sqslam
