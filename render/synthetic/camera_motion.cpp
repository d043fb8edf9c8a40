#include "render/synthetic/camera_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace sqslam {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;  // position, look-at

Vector6d Waypoint(const SceneDescription& scene, int i) {
  const auto last = static_cast<int>(scene.waypoints.size()) - 1;
  const SceneWaypoint& waypoint = scene.waypoints[static_cast<std::size_t>(std::clamp(i, 0, last))];
  return (Vector6d() << waypoint.position, waypoint.look_at).finished();
}

// Uniform cubic B-spline over the waypoints: two continuous derivatives, as a hand moves. It passes the ends
// and rounds the way off at the waypoints between.
Vector6d SplineAt(const SceneDescription& scene, double t) {
  const int i = static_cast<int>(std::floor(t));
  const double u = t - i;
  const std::array<double, 4> weights = {(1 - u) * (1 - u) * (1 - u) / 6.0,
                                         (3 * u * u * u - 6 * u * u + 4) / 6.0,
                                         (-3 * u * u * u + 3 * u * u + 3 * u + 1) / 6.0, u * u * u / 6.0};
  Vector6d sum = Vector6d::Zero();
  for (int k = 0; k < 4; ++k) {
    sum += weights[static_cast<std::size_t>(k)] * Waypoint(scene, i - 1 + k);
  }
  return sum;
}

// Samples of the curve with the way made up to each, so that time can be spread evenly over it. Turning
// counts too: a metre of the way and a metre that the aim moves cost the same time together.
struct MeasuredCurve {
  std::vector<Vector6d> samples;
  std::vector<double> way;

  explicit MeasuredCurve(const SceneDescription& scene) {
    constexpr int kSamplesPerSpan = 100;
    const double first = -1.0;  // repeated end points make the curve start and end there
    const double last = static_cast<double>(scene.waypoints.size());
    const int count = static_cast<int>((last - first) * kSamplesPerSpan);
    for (int i = 0; i <= count; ++i) {
      samples.push_back(SplineAt(scene, first + (last - first) * i / count));
      way.push_back(
          i == 0
              ? 0.0
              : way.back() +
                    (samples[static_cast<std::size_t>(i)] - samples[static_cast<std::size_t>(i) - 1]).norm());
    }
  }

  Vector6d At(double distance) const {
    const auto it = std::upper_bound(way.begin() + 1, way.end() - 1, distance);
    const auto i = static_cast<std::size_t>(it - way.begin());
    const double span = way[i] - way[i - 1];
    const double u = span > 0.0 ? std::clamp((distance - way[i - 1]) / span, 0.0, 1.0) : 0.0;
    return samples[i - 1] + u * (samples[i] - samples[i - 1]);
  }
};

// Part of the way made after the part `t` of the time: even, with soft ends.
double Progress(double t) {
  constexpr double kRamp = 0.06;
  const auto integral = [](double x) {  // of a speed that rises smoothly from 0 to 1 within kRamp
    const double u = std::min(x / kRamp, 1.0);
    return kRamp * (u * u * u - 0.5 * u * u * u * u) + std::max(0.0, x - kRamp);
  };
  const double total = 1.0 - kRamp;
  return t <= 0.5 ? integral(t) / total : 1.0 - integral(1.0 - t) / total;
}

// A sum of incommensurable sines for each of six axes.
class Tremor {
 public:
  explicit Tremor(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    for (auto& axis : phases_) {
      for (double& phase : axis) {
        phase = 2.0 * std::numbers::pi * (static_cast<double>(random() >> 11) * 0x1.0p-53);
      }
    }
  }

  double At(std::size_t axis, double seconds) const {
    static constexpr std::array<double, 4> kHertz = {0.53, 1.31, 2.7, 5.3};
    static constexpr std::array<double, 4> kWeight = {0.6, 0.4, 0.2, 0.07};
    double sum = 0.0;
    for (std::size_t i = 0; i < kHertz.size(); ++i) {
      sum += kWeight[i] * std::sin(2.0 * std::numbers::pi * kHertz[i] * seconds + phases_[axis][i]);
    }
    return sum;
  }

 private:
  std::array<std::array<double, 4>, 6> phases_{};
};

}  // namespace

Rigid3d LookAt(const Eigen::Vector3d& position, const Eigen::Vector3d& target) {
  const Eigen::Vector3d forward = (target - position).normalized();
  Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ());
  right = right.norm() > 1e-6 ? right.normalized() : Eigen::Vector3d::UnitX();
  Eigen::Matrix3d rotation;
  rotation << right, forward.cross(right), forward;
  return {Eigen::Quaterniond(rotation).normalized(), position};
}

std::vector<Rigid3d> HandHeldMotion(const SceneDescription& scene, int frames, std::uint64_t seed) {
  const MeasuredCurve curve(scene);
  const Tremor tremor(seed);
  std::vector<Rigid3d> poses;
  poses.reserve(static_cast<std::size_t>(frames));
  for (int i = 0; i < frames; ++i) {
    const double seconds = i / scene.camera.fps;
    const double part = frames > 1 ? static_cast<double>(i) / (frames - 1) : 0.0;
    const Vector6d state = curve.At(Progress(part) * curve.way.back());
    Rigid3d pose = LookAt(state.head<3>(), state.tail<3>());
    Eigen::Vector3d angles;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      pose.translation[static_cast<Eigen::Index>(axis)] += scene.tremor_position * tremor.At(axis, seconds);
      angles[static_cast<Eigen::Index>(axis)] = scene.tremor_angle * tremor.At(axis + 3, seconds);
    }
    if (angles.norm() > 0.0) {
      pose.rotation = (pose.rotation * Eigen::AngleAxisd(angles.norm(), angles.normalized())).normalized();
    }
    poses.push_back(pose);
  }
  return poses;
}

}  // namespace sqslam
