#pragma once

#include <cmath>
#include <string>

#include "slam/snapshot/snapshot.h"

namespace sqslam::testing {

inline SnapshotObject MakeObject(int id, const std::string& label, const Eigen::Vector3d& half_size, double x,
                                 double y, double bottom, double yaw = 0.0) {
  SnapshotObject object;
  object.id = id;
  object.label = label;
  object.observations = 50;
  object.fit.reliability = 0.9;
  object.yaw = yaw;
  const bool round = label == "cup" || label == "bottle" || label == "bowl";
  const bool ball = label == "apple" || label == "sports_ball";
  object.superquadric.shape = {half_size, ball ? 1.0 : 0.15, round || ball ? 1.0 : 0.15};
  object.superquadric.T_map_object = {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())),
                                      {x, y, bottom + half_size.z()}};
  object.fit.covariance.diagonal().setConstant(1e-6);  // 1 mm, 0.06 degrees
  return object;
}

// A furnished room in metres, z up, whose relations are known by construction. Cup 3 is uncertain, bottle 4
// has the name "oil". Keyframes look along +y (frames 0 to 40) and, from the other side, along -y (frames 50
// to 90).
inline MapSnapshot MadeRoom() {
  MapSnapshot map;
  map.camera = {.width = 640, .height = 480, .fx = 500.0, .fy = 500.0, .cx = 319.5, .cy = 239.5};
  map.gravity_known = true;
  map.metric = true;
  map.objects = {
      MakeObject(1, "dining_table", {0.8, 0.5, 0.37}, 0.0, 0.0, 0.0),
      MakeObject(2, "cup", {0.04, 0.04, 0.05}, -0.5, -0.2, 0.74),
      MakeObject(3, "cup", {0.04, 0.04, 0.045}, 0.5, 0.2, 0.74),
      MakeObject(4, "bottle", {0.04, 0.04, 0.14}, -0.4, -0.18, 0.74),
      MakeObject(5, "book", {0.12, 0.08, 0.02}, 0.1, -0.1, 0.74, 0.3),
      MakeObject(6, "book", {0.10, 0.07, 0.015}, 0.1, -0.1, 0.78, 0.1),
      MakeObject(7, "bowl", {0.10, 0.10, 0.05}, -0.1, 0.3, 0.74),
      MakeObject(8, "apple", {0.04, 0.04, 0.04}, -0.1, 0.3, 0.76),
      MakeObject(9, "chair", {0.22, 0.22, 0.44}, 0.4, -0.45, 0.0),
      MakeObject(10, "chair", {0.22, 0.22, 0.44}, 1.6, 0.0, 0.0),
      MakeObject(11, "cushion", {0.18, 0.18, 0.05}, 1.6, 0.0, 0.44),
      MakeObject(12, "bookshelf", {0.45, 0.16, 0.9}, -2.0, 1.0, 0.0),
      MakeObject(13, "book", {0.02, 0.1, 0.13}, -2.1, 1.0, 1.0),
      MakeObject(14, "box", {0.2, 0.15, 0.15}, -1.25, 1.0, 0.0),
      MakeObject(15, "sports_ball", {0.11, 0.11, 0.11}, 1.6, 1.5, 0.0),
      MakeObject(16, "skateboard", {0.1, 0.03, 0.4}, -2.0, 0.8, 0.0),
  };
  map.objects[2].fit.reliability = 0.2;
  map.objects[3].name = "oil";
  for (int i = 0; i < 4000; ++i) {  // the floor, in a sunflower's pattern
    const double angle = 2.399963 * i, radius = 0.05 * std::sqrt(i);
    map.points.push_back(
        {Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), 0.0).cast<float>()});
  }
  for (int i = 0; i < 10; ++i) {
    const bool front = i < 5;
    const Eigen::Vector3d eye(0.3 * (i % 5), front ? -3.0 : 3.0, 1.0);
    Eigen::Matrix3d axes;  // x right, y down, z ahead
    axes.col(2) = Eigen::Vector3d(0.0, front ? 1.0 : -1.0, 0.0);
    axes.col(1) = -Eigen::Vector3d::UnitZ();
    axes.col(0) = axes.col(1).cross(axes.col(2));
    map.keyframes.push_back({i, 10 * i, i / 3.0, {Eigen::Quaterniond(axes), eye}});
  }
  return map;
}

}  // namespace sqslam::testing
