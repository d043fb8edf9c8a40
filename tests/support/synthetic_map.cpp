#include "tests/support/synthetic_map.h"

#include <random>

namespace sqslam::testing {

SyntheticMap MakeSyntheticMap(const SyntheticMapOptions& options) {
  SyntheticMap world{
      {640, 480, 500.0, 500.0, 320.0, 240.0, {}, 30.0}, {}, {}, Map(ScaleLevels(OrbOptions{}))};
  std::mt19937_64 random(options.seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::vector<Descriptor> descriptors;
  for (int i = 0; i < options.points; ++i) {
    world.points.emplace_back(uniform(random), 0.8 * uniform(random), uniform(random));
    Descriptor& descriptor = descriptors.emplace_back();
    for (std::uint8_t& byte : descriptor) {
      byte = static_cast<std::uint8_t>(random());
    }
  }
  for (int k = 0; k < options.keyframes; ++k) {
    const double angle = 0.12 * k;
    const Rigid3d T_map_camera{
        Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY())),
        Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()) * Eigen::Vector3d(0.0, 0.0, -4.0)};
    world.T_camera_map.push_back(T_map_camera.Inverse());
    FrameFeatures features;
    for (const Eigen::Vector3d& p : world.points) {
      const Eigen::Vector2d pixel = world.camera.Project(world.T_camera_map.back() * p) +
                                    options.pixel_noise * Eigen::Vector2d(noise(random), noise(random));
      features.keypoints.push_back({pixel, pixel, 0.0F, 0});
    }
    features.descriptors = descriptors;
    features.colors.resize(world.points.size());
    features.grid = KeypointGrid(features.keypoints, world.camera.width, world.camera.height);
    world.map.AddKeyframe(k, k / 30.0, world.T_camera_map.back(),
                          std::make_shared<const FrameFeatures>(std::move(features)));
  }
  for (int i = 0; i < options.points; ++i) {
    const PointId point = world.map.AddPoint(world.points[static_cast<std::size_t>(i)], 0);
    for (int k = 0; k < options.keyframes; ++k) {
      world.map.AddObservation(point, k, i);
    }
    world.map.UpdateAppearance(point);
  }
  for (int k = 0; k < options.keyframes; ++k) {
    world.map.UpdateCovisibility(k);
  }
  return world;
}

int CountBrokenReferences(const Map& map) {
  int broken = 0;
  for (const MapPoint& point : map.Points()) {
    for (const Observation& o : point.observations) {
      const bool returned = map.HasKeyframe(o.keyframe) &&
                            map.At(o.keyframe).points[static_cast<std::size_t>(o.keypoint)] == point.id;
      broken += returned ? 0 : 1;
    }
  }
  for (const auto& [id, keyframe] : map.Keyframes()) {
    for (std::size_t i = 0; i < keyframe.points.size(); ++i) {
      if (keyframe.points[i] == kNoPoint) {
        continue;
      }
      bool returned = false;
      for (const Observation& o : map.Point(keyframe.points[i]).observations) {
        returned = returned || (o.keyframe == id && o.keypoint == static_cast<int>(i));
      }
      broken += returned ? 0 : 1;
    }
    for (const auto& [other, weight] : keyframe.covisibility) {
      broken += map.HasKeyframe(other) && map.At(other).covisibility.contains(id) ? 0 : 1;
    }
  }
  return broken;
}

}  // namespace sqslam::testing
