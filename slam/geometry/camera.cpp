#include "slam/geometry/camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace sqslam {
namespace {

Eigen::Vector2d Distort(const std::array<double, 5>& d, const Eigen::Vector2d& n) {
  const auto [k1, k2, p1, p2, k3] = d;
  const double x = n.x();
  const double y = n.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
          y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y};
}

}  // namespace

bool Camera::HasDistortion() const {
  return std::ranges::any_of(distortion, [](double k) { return k != 0.0; });
}

Eigen::Vector2d Camera::ProjectDistorted(const Eigen::Vector3d& p_camera) const {
  return Project(Distort(distortion, p_camera.hnormalized()).homogeneous());
}

Eigen::Vector2d Camera::Undistort(const Eigen::Vector2d& pixel) const {
  if (!HasDistortion()) {
    return pixel;
  }
  constexpr int kIterations = 20;
  constexpr double kFoldedError = 1e-12;  // squared, focal lengths; smaller errors are rounding
  const Eigen::Vector2d target = Unproject(pixel).head<2>();
  Eigen::Vector2d n = target;
  double last_error = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kIterations; ++i) {
    const Eigen::Vector2d step = target - Distort(distortion, n);
    // Beyond the radius at which the lens model folds over (strong negative k1 alone, far from the centre) no
    // ray has this pixel and the iteration diverges: the result is finite, but meaningless.
    const double error = step.squaredNorm();
    if (error > last_error && error > kFoldedError) {
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

Camera TurnedCamera(const Camera& camera, int quarter_turns) {
  Camera turned = camera;
  for (int i = 0; i < ((quarter_turns % 4) + 4) % 4; ++i) {  // (x, y) -> (height - 1 - y, x)
    const Camera before = turned;
    turned.width = before.height;
    turned.height = before.width;
    turned.fx = before.fy;
    turned.fy = before.fx;
    turned.cx = before.height - 1.0 - before.cy;
    turned.cy = before.cx;
    turned.distortion[2] = before.distortion[3];
    turned.distortion[3] = -before.distortion[2];
  }
  if (quarter_turns % 2 != 0) {
    turned.readout_ms = 0.0;
  } else if (quarter_turns % 4 != 0) {
    turned.readout_ms = -camera.readout_ms;
  }
  return turned;
}

double HorizontalFieldOfView(const Camera& camera) {
  return std::atan((camera.cx + 0.5) / camera.fx) + std::atan((camera.width - 0.5 - camera.cx) / camera.fx);
}

}  // namespace sqslam
