#include "tests/render/sample_map.h"

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

namespace sqslam {
namespace {

constexpr std::array<const char*, 7> kLabels = {"cup",  "book",   "sports_ball", "keyboard",
                                                "vase", "bottle", "cereal_box"};

class Dice {
 public:
  double operator()(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_() >> 11) * 0x1.0p-53);
  }

 private:
  std::mt19937_64 random_{7};
};

SnapshotObject MakeObject(int i, int columns, Dice& dice) {
  SnapshotObject object;
  object.id = i;
  object.label = kLabels[static_cast<std::size_t>(i) % kLabels.size()];
  object.observations = 20 + i;
  object.yaw = dice(-1.5, 1.5);
  Superquadric& shape = object.superquadric.shape;
  shape.half_size = {dice(0.05, 0.11), dice(0.05, 0.11), dice(0.05, 0.16)};
  shape.e1 = std::array{0.1, 0.1, 1.0, 0.4}[static_cast<std::size_t>(i) % 4];
  shape.e2 = std::array{0.1, 1.0, 1.0, 0.5}[static_cast<std::size_t>(i) % 4];
  object.superquadric.T_map_object = {
      Eigen::Quaterniond(Eigen::AngleAxisd(object.yaw, Eigen::Vector3d::UnitZ())),
      {0.32 * (i % columns), 0.32 * (i / columns), 0.7 + shape.half_size.z()}};
  return object;
}

SnapshotPoint MakePoint(int i, const MapSnapshot& map, double width, Dice& dice) {
  SnapshotPoint point;
  const bool on_object = i % 3 == 0 && !map.objects.empty();
  if (on_object) {
    const SnapshotObject& object = map.objects[static_cast<std::size_t>(i / 3) % map.objects.size()];
    point.object_id = object.id;
    const Eigen::Vector3d surface =
        object.superquadric.shape.PointAt(dice(-1.4, 1.4), dice(-std::numbers::pi, std::numbers::pi));
    point.p_map = (object.superquadric.T_map_object * surface).cast<float>();
  } else {
    const double reach = i % 100 == 1 ? 40.0 : 1.0;  // one in a hundred is a stray
    point.p_map = Eigen::Vector3d(reach * dice(-0.5, width + 0.5), reach * dice(-0.5, width + 0.5),
                                  0.7 + 0.01 * dice(-1.0, 1.0) + (reach - 1.0) * dice(0.0, 0.1))
                      .cast<float>();
  }
  for (std::uint8_t& channel : point.rgb) {
    channel = static_cast<std::uint8_t>(dice(30.0, 230.0));
  }
  return point;
}

}  // namespace

MapSnapshot MakeSampleMap(int objects, int points) {
  MapSnapshot map;
  map.camera = {.width = 640, .height = 480, .fx = 525.0, .fy = 525.0, .cx = 319.5, .cy = 239.5};
  map.gravity_known = true;
  map.support_height = 0.7;
  Dice dice;
  const int columns = std::max(1, static_cast<int>(std::ceil(std::sqrt(objects))));
  for (int i = 0; i < objects; ++i) {
    map.objects.push_back(MakeObject(i, columns, dice));
  }
  const double width = 0.32 * (columns - 1);
  for (int i = 0; i < points; ++i) {
    map.points.push_back(MakePoint(i, map, width, dice));
  }
  const Eigen::Vector3d middle(0.5 * width, 0.5 * width, 0.75);
  for (int i = 0; i < 12; ++i) {
    const double angle = -0.85 * std::numbers::pi + 0.06 * std::numbers::pi * i;
    const Eigen::Vector3d position =
        middle + (width + 0.6) * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.4);
    const Eigen::Vector3d forward = (middle - position).normalized();
    const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    Eigen::Matrix3d rotation;
    rotation << right, forward.cross(right), forward;
    map.keyframes.push_back({i, 10 * i, i / 3.0, {Eigen::Quaterniond(rotation), position}});
  }
  map.T_map_camera = map.keyframes.back().T_map_camera;
  return map;
}

}  // namespace sqslam
