#include "tests/support/ring_map.h"

#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "tests/support/textured_world.h"

namespace sqslam::testing {
namespace {

constexpr double kStep = 15.0;  // degrees between keyframes
constexpr double kRadians = std::numbers::pi / 180.0;

struct WorldPoint {
  double bearing = 0.0;  // degrees in [0, 360)
  Eigen::Vector3d p_world;
  Descriptor descriptor{};
};

std::vector<WorldPoint> MakeWall() {
  constexpr int kPoints = 1500;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<WorldPoint> wall(kPoints);
  for (WorldPoint& point : wall) {
    point.bearing = 360.0 * uniform(random);
    const double radius = 3.5 + uniform(random);
    const double a = point.bearing * kRadians;
    point.p_world = {radius * std::sin(a), 2.0 * uniform(random) - 1.0, radius * std::cos(a)};
    for (std::uint8_t& byte : point.descriptor) {
      byte = static_cast<std::uint8_t>(random());
    }
  }
  return wall;
}

// What the drift has made of the world by the time that the camera has turned by `angle` degrees.
Sim3d DriftAt(const RingMapOptions& options, double angle) {
  return {std::exp(options.scale_drift * angle),
          Eigen::Quaterniond(Eigen::AngleAxisd(options.rotation_drift * angle * kRadians,
                                               Eigen::Vector3d(0.3, 0.2, 1.0).normalized())),
          {0.0, 0.0, 0.0}};
}

}  // namespace

RingMap MakeRingMap(const RingMapOptions& options) {
  const auto ids = std::make_shared<IdSource>();
  ids->next_keyframe = options.first_id;
  ids->next_point = 1000 * options.first_id;
  RingMap ring{{640, 480, 500.0, 500.0, 320.0, 240.0, {}, 30.0}, {}, Map(ScaleLevels(OrbOptions{}), ids)};
  const std::vector<WorldPoint> wall = MakeWall();
  std::map<std::pair<std::size_t, int>, PointId> known;  // by point and how often the camera has come round
  for (int k = 0; k < options.keyframes; ++k) {
    const double angle = kStep * k;
    const Eigen::Quaterniond rotation(Eigen::AngleAxisd(angle * kRadians, Eigen::Vector3d::UnitY()));
    const Rigid3d T_world_camera{rotation, rotation * Eigen::Vector3d(0.0, 0.0, 1.0)};
    ring.T_world_camera.push_back(T_world_camera);
    FrameFeatures features;
    std::vector<std::pair<std::size_t, int>> seen;
    for (std::size_t i = 0; i < wall.size(); ++i) {
      const Eigen::Vector3d p_camera = T_world_camera.Inverse() * wall[i].p_world;
      if (p_camera.z() < 0.5) {
        continue;
      }
      const Eigen::Vector2d pixel = ring.camera.Project(p_camera);
      if (pixel.x() < 0.0 || pixel.y() < 0.0 || pixel.x() >= ring.camera.width ||
          pixel.y() >= ring.camera.height) {
        continue;
      }
      features.keypoints.push_back({pixel, pixel, 0.0F, 0});
      features.descriptors.push_back(wall[i].descriptor);
      seen.emplace_back(i, static_cast<int>(std::floor((angle - wall[i].bearing + 180.0) / 360.0)));
    }
    features.colors.resize(seen.size());
    features.grid = KeypointGrid(features.keypoints, ring.camera.width, ring.camera.height);
    const KeyframeId id =
        ring.map.AddKeyframe(k, k / 30.0, MoveCamera(T_world_camera.Inverse(), DriftAt(options, angle)),
                             std::make_shared<const FrameFeatures>(std::move(features)));
    for (std::size_t j = 0; j < seen.size(); ++j) {
      const auto& [i, lap] = seen[j];
      auto it = known.find(seen[j]);
      if (it == known.end()) {
        const Sim3d drift = DriftAt(options, wall[i].bearing + 360.0 * lap);
        it = known.emplace(seen[j], ring.map.AddPoint(drift * wall[i].p_world, id)).first;
      }
      ring.map.AddObservation(it->second, id, static_cast<int>(j));
    }
  }
  for (const MapPoint& point : ring.map.Points()) {
    ring.map.UpdateAppearance(point.id);
  }
  for (int k = 0; k < options.keyframes; ++k) {
    ring.map.UpdateCovisibility(options.first_id + k);
  }
  return ring;
}

double CenterError(const RingMap& ring) {
  std::vector<Eigen::Vector3d> estimate;
  std::vector<Eigen::Vector3d> truth;
  for (const auto& [id, keyframe] : ring.map.Keyframes()) {
    estimate.push_back(keyframe.Center());
    truth.push_back(ring.T_world_camera[static_cast<std::size_t>(id)].translation);
  }
  return AlignedError(estimate, truth);
}

}  // namespace sqslam::testing
