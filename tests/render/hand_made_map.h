#pragma once

#include <cmath>
#include <string>

#include "slam/snapshot/snapshot.h"

namespace sqslam {

// A small desk: a box, a can and a ball on a plane at z = 0, points around them, an arc of keyframes.
inline MapSnapshot HandMadeMap() {
  MapSnapshot map;
  map.camera = {.width = 320, .height = 240, .fx = 300.0, .fy = 300.0, .cx = 159.5, .cy = 119.5};
  map.gravity_known = true;
  map.support_height = 0.0;
  const auto add = [&map](const std::string& label, const Superquadric& shape, double x, double y) {
    SnapshotObject object;
    object.id = static_cast<int>(map.objects.size());
    object.label = label;
    object.superquadric.shape = shape;
    object.superquadric.T_map_object.translation = {x, y, shape.half_size.z()};
    map.objects.push_back(object);
  };
  add("book", {{0.3, 0.2, 0.1}, 0.2, 0.2}, -0.4, 0.1);
  add("cup", {{0.12, 0.12, 0.2}, 0.2, 1.0}, 0.3, -0.2);
  add("sports_ball", {{0.15, 0.15, 0.15}, 1.0, 1.0}, 0.3, 0.4);
  for (int i = 0; i < 400; ++i) {  // a sunflower's pattern: even and without chance
    const double angle = 2.399963 * i;
    const double radius = 0.045 * std::sqrt(i);
    const auto level = static_cast<std::uint8_t>(40 + i % 200);
    map.points.push_back(
        {Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), 0.0).cast<float>(),
         {level, 120, 90},
         i % 9 == 0 ? 0 : -1});
  }
  for (int i = 0; i < 8; ++i) {
    const double angle = -2.2 + 0.18 * i;
    const Eigen::Vector3d eye(2.0 * std::cos(angle), 2.0 * std::sin(angle), 1.0);
    Eigen::Matrix3d axes;  // x right, y down, z to the middle of the desk
    axes.col(2) = -eye.normalized();
    axes.col(0) = axes.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
    axes.col(1) = axes.col(2).cross(axes.col(0));
    map.keyframes.push_back({i, 10 * i, i / 3.0, {Eigen::Quaterniond(axes), eye}});
  }
  for (std::int64_t i = 0; i < 8; ++i) {  // the farther apart, the less they share
    for (std::int64_t k = i + 1; k < 8; ++k) {
      map.covisibility.push_back({i, k, static_cast<std::int32_t>(200 / (k - i))});
    }
  }
  map.T_map_camera = map.keyframes.back().T_map_camera;
  map.frame_index = 70;
  map.timestamp = 7.0 / 3.0;
  return map;
}

}  // namespace sqslam
