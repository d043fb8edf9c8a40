#include "render/synthetic/lighting.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sqslam {
namespace {

constexpr int kLampSamples = 5;        // a side
constexpr int kAmbientSamples = 20;    // directions of the hemisphere
constexpr double kAmbientReach = 0.5;  // metres; what is farther away does not dim ambient light
constexpr double kLift = 2e-3;         // metres; a surface must not shadow itself

// Does the segment from a to b (object frame) enter the body? The radial scale is a norm, hence convex along
// the segment, and a golden-section search finds its least value.
bool Enters(const Superquadric& shape, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  double begin = 0.0;
  double end = 1.0;
  const Eigen::Vector3d d = b - a;
  for (int axis = 0; axis < 3; ++axis) {
    const double h = shape.half_size[axis];
    if (std::abs(d[axis]) < 1e-12) {
      if (std::abs(a[axis]) > h) {
        return false;
      }
      continue;
    }
    const double t0 = (-h - a[axis]) / d[axis];
    const double t1 = (h - a[axis]) / d[axis];
    begin = std::max(begin, std::min(t0, t1));
    end = std::min(end, std::max(t0, t1));
  }
  if (begin >= end) {
    return false;
  }
  constexpr double kGolden = 0.381966;
  double left = begin + kGolden * (end - begin);
  double right = end - kGolden * (end - begin);
  double f_left = shape.RadialScale(a + left * d);
  double f_right = shape.RadialScale(a + right * d);
  for (int i = 0; i < 10; ++i) {
    if (std::min(f_left, f_right) < 1.0) {
      return true;
    }
    if (f_left < f_right) {
      end = right;
      right = left;
      f_right = f_left;
      left = begin + kGolden * (end - begin);
      f_left = shape.RadialScale(a + left * d);
    } else {
      begin = left;
      left = right;
      f_left = f_right;
      right = end - kGolden * (end - begin);
      f_right = shape.RadialScale(a + right * d);
    }
  }
  return std::min(f_left, f_right) < 1.0;
}

// Direction i of n of a cosine-weighted hemisphere about z (Fibonacci spiral).
Eigen::Vector3d HemisphereDirection(int i, int n) {
  const double radius = std::sqrt((i + 0.5) / n);
  const double angle = 2.0 * std::numbers::pi * std::fmod(i * 0.6180339887, 1.0);
  return {radius * std::cos(angle), radius * std::sin(angle), std::sqrt(1.0 - radius * radius)};
}

}  // namespace

SceneLighting::SceneLighting(const SceneDescription& scene) : scene_(scene) {
  for (const SceneBody& body : scene.bodies) {
    occluders_.push_back({body.superquadric.shape, body.superquadric.T_map_object.Inverse(),
                          body.superquadric.T_map_object.translation,
                          body.superquadric.shape.half_size.squaredNorm()});
  }
}

bool SceneLighting::Blocked(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  const Eigen::Vector3d ray = to - from;
  const double length2 = ray.squaredNorm();
  return std::any_of(occluders_.begin(), occluders_.end(), [&](const Occluder& occluder) {
    const Eigen::Vector3d offset = occluder.center - from;
    const double t = std::clamp(offset.dot(ray) / length2, 0.0, 1.0);
    return (offset - t * ray).squaredNorm() < occluder.radius2 &&
           Enters(occluder.shape, occluder.T_object_world * from, occluder.T_object_world * to);
  });
}

Eigen::Vector3d SceneLighting::IrradianceAt(const Eigen::Vector3d& p_world,
                                            const Eigen::Vector3d& normal) const {
  const Eigen::Vector3d origin = p_world + kLift * normal;
  Eigen::Vector3d irradiance = Eigen::Vector3d::Zero();
  for (const SceneLight& light : scene_.lights) {
    const Eigen::Vector3d area = 4.0 * light.half_u.cross(light.half_v);
    double sum = 0.0;
    for (int i = 0; i < kLampSamples * kLampSamples; ++i) {
      const double s = 2.0 * (i % kLampSamples + 0.5) / kLampSamples - 1.0;
      const double t = 2.0 * (i / kLampSamples + 0.5) / kLampSamples - 1.0;  // NOLINT: whole rows
      const Eigen::Vector3d lamp = light.center + s * light.half_u + t * light.half_v;
      const Eigen::Vector3d ray = lamp - origin;
      const double distance2 = ray.squaredNorm();
      const double cosines = normal.dot(ray) * std::max(0.0, -area.dot(ray)) / distance2;
      if (cosines > 0.0 && !Blocked(origin, lamp)) {
        sum += cosines / distance2;
      }
    }
    irradiance += light.rgb * (sum / (kLampSamples * kLampSamples));
  }
  const Eigen::Quaterniond to_normal = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal);
  int open = 0;
  for (int i = 0; i < kAmbientSamples; ++i) {
    open += Blocked(origin, origin + kAmbientReach * (to_normal * HemisphereDirection(i, kAmbientSamples)))
                ? 0
                : 1;
  }
  return irradiance + scene_.ambient * (static_cast<double>(open) / kAmbientSamples);
}

}  // namespace sqslam
