#include "tests/support/synthetic_map.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <utility>

#include "tests/support/textured_world.h"

namespace sqslam::testing {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
constexpr double kRingStep = 15.0;  // degrees between keyframes

Descriptor RandomBits(std::mt19937_64& random) {
  Descriptor descriptor;
  for (std::uint8_t& byte : descriptor) {
    byte = static_cast<std::uint8_t>(random());
  }
  return descriptor;
}

void FlipBits(int count, std::mt19937_64& random, Descriptor& descriptor) {
  std::set<unsigned> bits;
  while (static_cast<int>(bits.size()) < count) {
    bits.insert(static_cast<unsigned>(random() % 256));
  }
  for (const unsigned bit : bits) {
    descriptor[bit / 8] = static_cast<std::uint8_t>(descriptor[bit / 8] ^ (1U << (bit % 8)));
  }
}

bool InImage(const Camera& camera, const Eigen::Vector2d& pixel) {
  return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < camera.width && pixel.y() < camera.height;
}

// The drift of the camera at `angle` degrees on the ring.
Sim3d DriftAt(const RingMapOptions& options, double angle) {
  return {std::exp(options.scale_drift * angle),
          Eigen::Quaterniond(Eigen::AngleAxisd(options.rotation_drift * angle * kRadians,
                                               Eigen::Vector3d(0.3, 0.2, 1.0).normalized())),
          {0.0, 0.0, 0.0}};
}

// Replaces the wall from 202 to 218 degrees by the wall from 22 to 38 degrees.
void RepeatOnTheOppositeSide(SyntheticWorld& world, std::vector<double>& bearings) {
  const std::vector<double> all = std::exchange(bearings, {});
  const std::vector<Eigen::Vector3d> points = std::exchange(world.points, {});
  const std::vector<Descriptor> descriptors = std::exchange(world.descriptors, {});
  const auto add = [&](std::size_t i, double turn) {
    bearings.push_back(all[i] + turn);
    world.points.emplace_back(Eigen::AngleAxisd(turn * kRadians, Eigen::Vector3d::UnitY()) * points[i]);
    world.descriptors.push_back(descriptors[i]);
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (all[i] < 202.0 || all[i] > 218.0) {
      add(i, 0.0);
    }
    if (all[i] >= 22.0 && all[i] <= 38.0) {
      add(i, 180.0);
    }
  }
}

void UpdateAll(Map& map) {
  for (const MapPoint& point : map.Points()) {
    map.UpdateAppearance(point.id);
  }
  for (const auto& [id, keyframe] : map.Keyframes()) {
    map.UpdateCovisibility(id);
  }
}

}  // namespace

SyntheticWorld::View SyntheticWorld::See(const Rigid3d& T_camera_world, const Sight& sight) const {
  constexpr double kNearest = 0.5;  // m
  std::mt19937_64 random(sight.seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  FrameFeatures features;
  View view;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p_camera = T_camera_world * points[i];
    if (p_camera.z() < kNearest) {
      continue;
    }
    const double dx = noise(random);
    const double dy = noise(random);
    const Eigen::Vector2d raw =
        camera.ProjectDistorted(p_camera) + sight.pixel_noise * Eigen::Vector2d(dx, dy);
    if (!InImage(camera, raw)) {
      continue;
    }
    features.keypoints.push_back({camera.Undistort(raw), raw, 0.0F, sight.octave});
    FlipBits(sight.flipped_bits, random, features.descriptors.emplace_back(descriptors[i]));
    view.points.push_back(static_cast<int>(i));
  }
  for (int i = 0; i < sight.clutter; ++i) {
    const double x = camera.width * uniform(random);
    const double y = camera.height * uniform(random);
    features.keypoints.push_back({{x, y}, {x, y}, 0.0F, sight.octave});
    features.descriptors.push_back(RandomBits(random));
    view.points.push_back(-1);
  }
  features.colors.resize(features.Size());
  features.grid = KeypointGrid(features.keypoints, camera.width, camera.height);
  view.features = std::make_shared<const FrameFeatures>(std::move(features));
  return view;
}

Rigid3d PoseOnArc(double place) {
  const Eigen::AngleAxisd turn(0.12 * place, Eigen::Vector3d::UnitY());
  return Rigid3d{Eigen::Quaterniond(turn), turn * Eigen::Vector3d(0.0, 0.0, -4.0)}.Inverse();
}

Rigid3d Turn(double radians, const Eigen::Vector3d& axis) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(radians, axis.normalized())), Eigen::Vector3d::Zero()};
}

Eigen::Vector3d PlaneUp() {  // tilted towards the cameras
  return Eigen::Vector3d(-0.1, -0.9, -0.42).normalized();
}

SyntheticMap MakeSyntheticMap(const SyntheticMapOptions& options) {
  SyntheticMap world{{}, {}, Map(ScaleLevels(OrbOptions{}))};
  world.camera = options.camera;
  std::mt19937_64 random(options.seed);
  std::uniform_real_distribution<double> uniform(-options.half_extent, options.half_extent);
  for (int i = 0; i < options.points; ++i) {
    const double x = uniform(random);
    const double y = uniform(random);
    const double z = uniform(random);
    Eigen::Vector3d& p = world.points.emplace_back(x, 0.8 * y, z);
    const double height = PlaneUp().dot(p);
    if (i < options.on_plane * options.points) {
      p -= height * PlaneUp();
    } else if (options.on_plane > 0.0 && height < 0.0) {
      p -= 2.0 * height * PlaneUp();
    }
    world.descriptors.push_back(RandomBits(random));
  }
  for (const Eigen::Vector3d& p : world.points) {
    world.map.AddPoint(p, 0);
  }
  for (int k = 0; k < options.keyframes; ++k) {
    const Rigid3d& T_camera_map = world.T_camera_map.emplace_back(PoseOnArc(k));
    const auto seed = 1000 * options.seed + static_cast<std::uint64_t>(k);
    const SyntheticWorld::View view =
        world.See(T_camera_map, {.pixel_noise = options.pixel_noise, .seed = seed});
    const KeyframeId id = world.map.AddKeyframe(k, k / 30.0, T_camera_map, view.features);
    for (std::size_t i = 0; i < view.points.size(); ++i) {
      world.map.AddObservation(view.points[i], id, static_cast<int>(i));
    }
  }
  UpdateAll(world.map);
  return world;
}

Rigid3d PoseOnRing(double degrees) {
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(degrees * kRadians, Eigen::Vector3d::UnitY()));
  return Rigid3d{rotation, rotation * Eigen::Vector3d(0.0, 0.0, 1.0)}.Inverse();
}

SyntheticMap MakeRingMap(const RingMapOptions& options) {
  constexpr int kPoints = 1500;
  const auto ids = options.ids ? options.ids : std::make_shared<IdSource>();
  ids->next_keyframe = options.first_id;
  ids->next_point = 1000 * options.first_id;
  SyntheticMap ring{{}, {}, Map(ScaleLevels(OrbOptions{}), ids)};
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<double> bearings;  // degrees in [0, 360), by point
  for (int i = 0; i < kPoints; ++i) {
    const double bearing = bearings.emplace_back(360.0 * uniform(random));
    const double radius = 3.5 + uniform(random);
    const double height = 2.0 * uniform(random) - 1.0;
    ring.points.emplace_back(radius * std::sin(bearing * kRadians), height,
                             radius * std::cos(bearing * kRadians));
    ring.descriptors.push_back(RandomBits(random));
  }
  if (options.repeated) {
    RepeatOnTheOppositeSide(ring, bearings);
  }
  std::map<std::pair<std::size_t, int>, PointId> known;  // by point and lap
  for (int k = 0; k < options.keyframes; ++k) {
    const double angle = kRingStep * k;
    const Rigid3d& T_camera_world = ring.T_camera_map.emplace_back(PoseOnRing(angle));
    const SyntheticWorld::View view = ring.See(T_camera_world);
    const KeyframeId id =
        ring.map.AddKeyframe(k, k / 30.0, MoveCamera(T_camera_world, DriftAt(options, angle)), view.features);
    for (std::size_t j = 0; j < view.points.size(); ++j) {
      const auto i = static_cast<std::size_t>(view.points[j]);
      const int lap = static_cast<int>(std::floor((angle - bearings[i] + 180.0) / 360.0));
      auto it = known.find({i, lap});
      if (it == known.end()) {
        const Sim3d drift = DriftAt(options, bearings[i] + 360.0 * lap);
        it = known.emplace(std::pair(i, lap), ring.map.AddPoint(drift * ring.points[i], id)).first;
      }
      ring.map.AddObservation(it->second, id, static_cast<int>(j));
    }
  }
  UpdateAll(ring.map);
  return ring;
}

double CenterError(const SyntheticMap& ring) {
  std::vector<Eigen::Vector3d> estimate;
  std::vector<Eigen::Vector3d> truth;
  for (const auto& [id, keyframe] : ring.map.Keyframes()) {
    estimate.push_back(keyframe.Center());
    truth.push_back(ring.T_camera_map[static_cast<std::size_t>(id)].Inverse().translation);
  }
  return AlignedError(estimate, truth);
}

double CenterDistance(const Rigid3d& T_camera1_map, const Rigid3d& T_camera2_map) {
  return (T_camera1_map.Inverse().translation - T_camera2_map.Inverse().translation).norm();
}

double LargestReprojectionError(const Map& map, const Camera& camera) {
  double largest = 0.0;
  for (const MapPoint& point : map.Points()) {
    for (const Observation& o : point.observations) {
      const Keyframe& keyframe = map.At(o.keyframe);
      const Eigen::Vector2d& seen = keyframe.features->keypoints[static_cast<std::size_t>(o.keypoint)].pixel;
      largest = std::max(largest, (camera.Project(keyframe.T_camera_map * point.p_map) - seen).norm());
    }
  }
  return largest;
}

FrameFeaturesPtr WithOctave(const FrameFeatures& features, int octave) {
  auto changed = std::make_shared<FrameFeatures>(features);
  for (Keypoint& keypoint : changed->keypoints) {
    keypoint.octave = octave;
  }
  return changed;
}

int CountBrokenReferences(const Map& map) {
  int broken = 0;
  for (const MapPoint& point : map.Points()) {
    std::set<KeyframeId> keyframes;
    for (const Observation& o : point.observations) {
      const bool returned = map.HasKeyframe(o.keyframe) &&
                            map.At(o.keyframe).points[static_cast<std::size_t>(o.keypoint)] == point.id;
      broken += returned && keyframes.insert(o.keyframe).second ? 0 : 1;
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

std::shared_ptr<const Vocabulary> RandomWords() {
  std::mt19937_64 random(8);
  std::vector<std::vector<Descriptor>> images(20, std::vector<Descriptor>(400));
  for (auto& image : images) {
    for (Descriptor& descriptor : image) {
      descriptor = RandomBits(random);
    }
  }
  VocabularyOptions options;
  options.depth = 3;
  return std::make_shared<const Vocabulary>(Vocabulary::Train(images, options));
}

void GiveWords(const Vocabulary& vocabulary, Map& map) {
  for (const auto& [id, keyframe] : map.Keyframes()) {
    map.At(id).words =
        std::make_shared<const BagOfWords>(vocabulary.Transform(keyframe.features->descriptors));
  }
}

}  // namespace sqslam::testing
