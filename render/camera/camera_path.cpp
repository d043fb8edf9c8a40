#include "render/camera/camera_path.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "slam/geometry/angles.h"

namespace sqslam {
namespace {

ViewCamera TurnedAbout(const Eigen::Vector3d& up, const ViewCamera& camera, double degrees) {
  const Eigen::AngleAxisd turn(degrees * kRadiansPerDegree, up.normalized());
  ViewCamera turned = camera;
  turned.position = camera.focal_point + turn * (camera.position - camera.focal_point);
  turned.view_up = turn * camera.view_up;
  return turned;
}

}  // namespace

ViewAxes AxesOf(const ViewCamera& camera) {
  const Eigen::Vector3d back = (camera.position - camera.focal_point).normalized();
  const Eigen::Vector3d right = camera.view_up.cross(back).normalized();
  return {right, back.cross(right), back};
}

ViewCamera FromAfar(const ViewCamera& camera) {
  constexpr double kTimesFarther = 1e4;  // a parallax of 1e-4, and ten digits left for depths
  ViewCamera afar = camera;
  if (camera.IsOrthographic()) {
    afar.projection = Projection::kPerspective;
    afar.position = camera.focal_point + kTimesFarther * (camera.position - camera.focal_point);
    afar.view_angle = 2.0 * std::atan(0.5 / (kTimesFarther * camera.FocalLength(1.0))) * kDegreesPerRadian;
  }
  return afar;
}

ViewCamera Azimuth(const ViewCamera& camera, double degrees) {
  ViewCamera turned = TurnedAbout(camera.view_up, camera, degrees);
  turned.view_up = camera.view_up;
  return turned;
}

ViewCamera Elevation(const ViewCamera& camera, double degrees) {
  const Eigen::Vector3d up = camera.view_up.normalized();
  const Eigen::Vector3d offset = camera.position - camera.focal_point;
  const double height = offset.dot(up);
  Eigen::Vector3d level = offset - height * up;
  if (level.norm() < 1e-9 * offset.norm()) {
    level = up.unitOrthogonal();  // straight above: the heading is arbitrary
  }
  const double now = std::atan2(height, (offset - height * up).norm());
  const double angle =
      std::clamp(now + degrees * kRadiansPerDegree, -89.0 * kRadiansPerDegree, 89.0 * kRadiansPerDegree);
  ViewCamera raised = camera;
  raised.position =
      camera.focal_point + offset.norm() * (std::cos(angle) * level.normalized() + std::sin(angle) * up);
  return raised;
}

ViewCamera Zoom(const ViewCamera& camera, double factor) {
  ViewCamera nearer = camera;
  nearer.position = camera.focal_point + (camera.position - camera.focal_point) / factor;
  return nearer;
}

std::vector<ViewCamera> OrbitPath(const ViewCamera& first, int frames, const Eigen::Vector3d& up) {
  std::vector<ViewCamera> path;
  for (int i = 0; i < frames; ++i) {
    path.push_back(TurnedAbout(up, first, 360.0 * i / frames));
  }
  return path;
}

std::vector<ViewCamera> SwingPath(const ViewCamera& middle, int frames, const Eigen::Vector3d& up,
                                  double sweep) {
  std::vector<ViewCamera> path;
  for (int i = 0; i < frames; ++i) {
    const double phase = frames > 1 ? static_cast<double>(i) / (frames - 1) : 1.0;
    path.push_back(TurnedAbout(up, middle, -0.5 * sweep * std::cos(std::numbers::pi * phase)));
  }
  return path;
}

ViewCamera ThroughCamera(const Rigid3d& T_map_camera, const Camera& camera) {
  ViewCamera view = FirstPerson(T_map_camera, camera, 1.0);
  view.pinhole = camera;
  return view;
}

Rigid3d PoseOf(const ViewCamera& view) {
  Eigen::Matrix3d axes;
  axes.col(2) = (view.focal_point - view.position).normalized();
  axes.col(0) = axes.col(2).cross(view.view_up).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return {Eigen::Quaterniond(axes).normalized(), FromAfar(view).position};
}

std::array<Eigen::Vector3d, 5> FrustumCorners(const Rigid3d& T_map_camera, const Camera& camera,
                                              double height) {
  constexpr Camera kUnknown{.width = 4, .height = 3, .fx = 3.0, .fy = 3.0, .cx = 1.5, .cy = 1.0};
  const Camera& lens = camera.height > 0 && camera.fx > 0.0 && camera.fy > 0.0 ? camera : kUnknown;
  const double right = lens.width - 0.5, bottom = lens.height - 0.5;
  const double depth = lens.fy / lens.height * height;
  const auto corner = [&](double u, double v) -> Eigen::Vector3d {
    return T_map_camera * Eigen::Vector3d(depth * lens.Unproject({u, v}));
  };
  return {T_map_camera.translation, corner(-0.5, -0.5), corner(right, -0.5), corner(right, bottom),
          corner(-0.5, bottom)};
}

ViewCamera FirstPerson(const Rigid3d& T_map_camera, const Camera& camera, double scene_depth) {
  ViewCamera view;
  view.position = T_map_camera.translation;
  view.focal_point = T_map_camera * Eigen::Vector3d(0.0, 0.0, scene_depth);
  view.view_up = T_map_camera.rotation * -Eigen::Vector3d::UnitY();
  view.view_angle =
      camera.fy > 0.0 ? 2.0 * std::atan(0.5 * camera.height / camera.fy) / kRadiansPerDegree : 45.0;
  return view;
}

ViewCamera Behind(const Rigid3d& T_map_camera, const Eigen::Vector3d& up, double distance) {
  const Eigen::Vector3d forward = T_map_camera.rotation * Eigen::Vector3d::UnitZ();
  ViewCamera view;
  view.position = T_map_camera.translation - distance * forward + 0.5 * distance * up;
  view.focal_point = T_map_camera.translation + distance * forward;
  view.view_up = up;
  view.view_angle = 45.0;
  return view;
}

std::vector<ViewCamera> Smooth(const std::vector<ViewCamera>& path, double radius) {
  std::vector<ViewCamera> smooth;
  const int size = static_cast<int>(path.size());
  const int reach = static_cast<int>(std::ceil(3.0 * radius));
  for (int i = 0; i < size; ++i) {
    ViewCamera sum{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0.0, {}};
    double weights = 0.0;
    for (int k = std::max(0, i - reach); k <= std::min(size - 1, i + reach); ++k) {
      const double weight = radius > 0.0 ? std::exp(-0.5 * (k - i) * (k - i) / (radius * radius)) : 1.0;
      const ViewCamera& other = path[static_cast<std::size_t>(k)];
      sum.position += weight * other.position;
      sum.focal_point += weight * other.focal_point;
      sum.view_up += weight * other.view_up;
      sum.view_angle += weight * other.view_angle;
      weights += weight;
    }
    sum.position /= weights;
    sum.focal_point /= weights;
    sum.view_up.normalize();
    sum.view_angle /= weights;
    smooth.push_back(sum);
  }
  return smooth;
}

std::vector<Rigid3d> PosesAlongKeyframes(const MapSnapshot& map, int count) {
  std::vector<Rigid3d> poses;
  const auto& keyframes = map.keyframes;
  for (int i = 0; i < count && !keyframes.empty(); ++i) {
    const double at =
        count > 1 ? static_cast<double>(i) * static_cast<double>(keyframes.size() - 1) / (count - 1) : 0.0;
    const auto a = static_cast<std::size_t>(at);
    const std::size_t b = std::min(a + 1, keyframes.size() - 1);
    const double t = at - static_cast<double>(a);
    const Rigid3d& from = keyframes[a].T_map_camera;
    const Rigid3d& to = keyframes[b].T_map_camera;
    poses.push_back({from.rotation.slerp(t, to.rotation), (1.0 - t) * from.translation + t * to.translation});
  }
  return poses;
}

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
    pinhole.fx = pinhole.fy = FromAfar(camera).FocalLength(window.height);
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
