#include "render/camera/camera_control.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace sqslam {
namespace {

// Drops the input camera's calibration: a view moved by hand is no longer that camera's.
ViewCamera WithoutPinhole(ViewCamera camera) {
  camera.pinhole.reset();
  return camera;
}

ViewCamera Shifted(const ViewCamera& camera, const Eigen::Vector3d& shift) {
  ViewCamera moved = WithoutPinhole(camera);
  moved.position += shift;
  moved.focal_point += shift;
  return moved;
}

// Returns map units per pixel at the distance of the focal point.
double UnitsPerPixel(const ViewCamera& camera, cv::Size window) {
  return camera.Distance() / camera.FocalLength(std::max(window.height, 1));
}

}  // namespace

ViewCamera Orbit(const ViewCamera& camera, const Eigen::Vector2d& pixels, cv::Size window,
                 const Eigen::Vector3d& up) {
  const double turn = 180.0 / std::max(window.height, 1);  // degrees a pixel
  ViewCamera moved = WithoutPinhole(camera);
  const Eigen::Vector3d offset = camera.position - camera.focal_point;
  // Straight above, the heading is the direction of the picture's top.
  if (offset.normalized().cross(up).norm() < 0.02) {
    moved.position -= 0.02 * offset.norm() * (camera.view_up - camera.view_up.dot(up) * up).normalized();
  }
  moved.view_up = up;
  return Elevation(Azimuth(moved, -turn * pixels.x()), turn * pixels.y());
}

ViewCamera LookAround(const ViewCamera& camera, const Eigen::Vector2d& pixels, cv::Size window,
                      const Eigen::Vector3d& up) {
  const double turn = camera.view_angle / std::max(window.height, 1);  // degrees a pixel
  ViewCamera moved = WithoutPinhole(camera);
  moved.view_up = up;
  std::swap(moved.position, moved.focal_point);  // the focal point turns about the eye
  moved = Elevation(Azimuth(moved, -turn * pixels.x()), -turn * pixels.y());
  std::swap(moved.position, moved.focal_point);
  return moved;
}

ViewCamera Pan(const ViewCamera& camera, const Eigen::Vector2d& pixels, cv::Size window) {
  const ViewAxes axes = AxesOf(camera);
  const double unit = UnitsPerPixel(camera, window);
  return Shifted(camera, unit * (pixels.y() * axes.up - pixels.x() * axes.right));
}

ViewCamera ZoomTo(const ViewCamera& camera, double factor, const Eigen::Vector2d& pixel, cv::Size window) {
  const ViewAxes axes = AxesOf(camera);
  const double unit = UnitsPerPixel(camera, window);
  const Eigen::Vector2d offset = pixel - 0.5 * Eigen::Vector2d(window.width, window.height);
  const Eigen::Vector3d target = camera.focal_point + unit * (offset.x() * axes.right - offset.y() * axes.up);
  ViewCamera moved = WithoutPinhole(camera);
  moved.position = target + (camera.position - target) / factor;
  moved.focal_point = target + (camera.focal_point - target) / factor;
  return moved;
}

ViewCamera Fly(const ViewCamera& camera, const Eigen::Vector3d& right_up_forward) {
  const ViewAxes axes = AxesOf(camera);
  return Shifted(camera, right_up_forward.x() * axes.right + right_up_forward.y() * axes.up -
                             right_up_forward.z() * axes.back);
}

Camera PinholeOf(const ViewCamera& camera, cv::Size window) {
  Camera pinhole;
  if (camera.pinhole) {
    pinhole = *camera.pinhole;
    const double x = static_cast<double>(window.width) / pinhole.width;
    const double y = static_cast<double>(window.height) / pinhole.height;
    pinhole.fx *= x;
    pinhole.fy *= y;
    pinhole.cx = (pinhole.cx + 0.5) * x - 0.5;
    pinhole.cy = (pinhole.cy + 0.5) * y - 0.5;
    pinhole = pinhole.WithoutDistortion();
  } else {
    pinhole.fx = pinhole.fy = camera.FocalLength(window.height);
    pinhole.cx = 0.5 * (window.width - 1);
    pinhole.cy = 0.5 * (window.height - 1);
  }
  pinhole.width = window.width;
  pinhole.height = window.height;
  return pinhole;
}

Ray RayOf(const ViewCamera& camera, const Eigen::Vector2d& pixel, cv::Size window) {
  const Camera pinhole = PinholeOf(camera, window);
  const Rigid3d T_map_view = PoseOf(camera);
  // Window pixels start at the corner, camera pixels at the centre of the first pixel.
  const Eigen::Vector3d direction = pinhole.Unproject(pixel - Eigen::Vector2d::Constant(0.5));
  return {T_map_view.translation, (T_map_view.rotation * direction).normalized()};
}

ViewCamera Between(const ViewCamera& from, const ViewCamera& to, double t) {
  if (t >= 1.0) {
    return to;
  }
  const double s = t * t * (3.0 - 2.0 * t);
  const Rigid3d a = PoseOf(from);
  const Rigid3d b = PoseOf(to);
  const Eigen::Quaterniond rotation = a.rotation.slerp(s, b.rotation);
  const double distance = std::exp((1.0 - s) * std::log(from.Distance()) + s * std::log(to.Distance()));
  ViewCamera view;
  view.focal_point = (1.0 - s) * from.focal_point + s * to.focal_point;
  view.position = view.focal_point - distance * (rotation * Eigen::Vector3d::UnitZ());
  view.view_up = rotation * -Eigen::Vector3d::UnitY();
  view.view_angle = (1.0 - s) * from.view_angle + s * to.view_angle;
  return view;
}

}  // namespace sqslam
