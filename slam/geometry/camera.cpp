#include "slam/geometry/camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace sqslam {
namespace {

// Bisects the angle: stays finite where strong coefficients fold the lens model over.
Eigen::Vector2d UndistortFisheye(const std::array<double, 5>& k, const Eigen::Vector2d& target) {
  constexpr double kMaxAngle = 85.0 * std::numbers::pi / 180.0;
  constexpr int kHalvings = 50;
  const double radius = target.norm();
  if (radius <= 1e-12) {
    return target;
  }
  double low = 0.0;
  double high = kMaxAngle;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (FisheyeRadius(k, middle) < radius ? low : high) = middle;
  }
  return std::tan(high) / radius * target;
}

}  // namespace

Camera Camera::WithoutDistortion() const {
  Camera camera = *this;
  camera.distortion = {};
  camera.lens = LensModel::kRadialTangential;
  return camera;
}

bool Camera::Shows(const Eigen::Vector2d& pixel) const {
  return InImage(lens == LensModel::kFisheye ? ProjectDistorted(Unproject(pixel)) : pixel);
}

std::array<double, 4> Camera::ShownBounds() const {
  std::array<double, 4> bounds = {0.0, 0.0, static_cast<double>(width), static_cast<double>(height)};
  if (lens == LensModel::kFisheye) {
    bounds = {Undistort({0.0, cy}).x(), Undistort({cx, 0.0}).y(), Undistort({width - 1.0, cy}).x(),
              Undistort({cx, height - 1.0}).y()};
    for (const double x : {0.0, width - 1.0}) {
      for (const double y : {0.0, height - 1.0}) {
        const Eigen::Vector2d corner = Undistort({x, y});
        bounds[0] = std::min(bounds[0], corner.x());
        bounds[1] = std::min(bounds[1], corner.y());
        bounds[2] = std::max(bounds[2], corner.x());
        bounds[3] = std::max(bounds[3], corner.y());
      }
    }
  }
  return bounds;
}

bool Camera::HasDistortion() const {
  return lens == LensModel::kFisheye || std::ranges::any_of(distortion, [](double k) { return k != 0.0; });
}

Eigen::Vector2d Camera::ProjectDistorted(const Eigen::Vector3d& p_camera) const {
  const Eigen::Vector2d n = p_camera.hnormalized();
  return Project(Distort(lens, distortion, n).homogeneous());
}

Eigen::Vector2d Camera::Undistort(const Eigen::Vector2d& pixel) const {
  if (!HasDistortion()) {
    return pixel;
  }
  constexpr int kIterations = 20;
  constexpr double kMinFoldedError = 1e-12;  // squared, focal lengths; smaller errors are rounding
  const Eigen::Vector2d target = Unproject(pixel).head<2>();
  if (lens == LensModel::kFisheye) {
    return Project(UndistortFisheye(distortion, target).homogeneous());
  }
  Eigen::Vector2d n = target;
  double last_error = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kIterations; ++i) {
    const Eigen::Vector2d step = target - DistortRadialTangential(distortion, n);
    // Beyond the radius at which the lens model folds over (strong negative k1 alone, far from the centre) no
    // ray has this pixel and the iteration diverges: the result is finite, but meaningless.
    const double error = step.squaredNorm();
    if (error > last_error && error > kMinFoldedError) {
      break;
    }
    last_error = error;
    n += step;
  }
  return Project(n.homogeneous());
}

Camera ResizedCamera(const Camera& camera, int width, int height) {
  Camera resized = camera;
  const double x = static_cast<double>(width) / camera.width;
  const double y = static_cast<double>(height) / camera.height;
  resized.width = width;
  resized.height = height;
  resized.fx *= x;
  resized.fy *= y;
  resized.cx = (camera.cx + 0.5) * x - 0.5;  // the image starts half a pixel before its first pixel centre
  resized.cy = (camera.cy + 0.5) * y - 0.5;
  return resized;
}

Camera RotatedCamera(const Camera& camera, int quarter_turns) {
  Camera turned = camera;
  for (int i = 0; i < ((quarter_turns % 4) + 4) % 4; ++i) {  // (x, y) -> (height - 1 - y, x)
    const Camera before = turned;
    turned.width = before.height;
    turned.height = before.width;
    turned.fx = before.fy;
    turned.fy = before.fx;
    turned.cx = before.height - 1.0 - before.cy;
    turned.cy = before.cx;
    if (camera.lens == LensModel::kRadialTangential) {
      turned.distortion[2] = before.distortion[3];
      turned.distortion[3] = -before.distortion[2];
    }
  }
  if (quarter_turns % 2 != 0) {
    turned.readout_ms = 0.0;
  } else if (quarter_turns % 4 != 0) {
    turned.readout_ms = -camera.readout_ms;
  }
  return turned;
}

double HorizontalFieldOfView(const Camera& camera) {
  const double left = (camera.cx + 0.5) / camera.fx;
  const double right = (camera.width - 0.5 - camera.cx) / camera.fx;
  return camera.lens == LensModel::kFisheye ? left + right : std::atan(left) + std::atan(right);
}

}  // namespace sqslam
