#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "slam/snapshot/snapshot.h"

namespace sqslam::testing {

// A snapshot in which every field has a value of its own.
inline MapSnapshot MakeSnapshot(int number, int points = 100) {
  MapSnapshot snapshot;
  snapshot.sequence_number = number;
  snapshot.frame_index = 10 * number;
  snapshot.timestamp = 0.1 * number;
  snapshot.image_path = "/images/" + std::to_string(number) + ".png";
  snapshot.camera = {640, 480, 500.0, 501.0, 320.0, 240.0, {0.1, 0.2, 0.3, 0.4, 0.5}, 25.0};
  snapshot.T_map_camera = Rigid3d{Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), {1.0, 2.0, number * 1.0}};
  snapshot.keyframes = {{3, 30, 1.0, *snapshot.T_map_camera}};
  for (int i = 0; i < points; ++i) {
    snapshot.points.push_back({{0.1F * i, 0.2F, -0.3F}, {static_cast<std::uint8_t>(i), 2, 3}, i % 5 - 1});
    snapshot.points.back().anomaly = 0.0078125F * static_cast<float>(i % 128);
    snapshot.points.back().rejected_by = i % 7 - 1;
  }
  SnapshotObject object{4, "cup", 0.5, 6, 7, 0.25, {}};
  object.superquadric.shape = {{0.1, 0.2, 0.3}, 0.4, 0.5};
  object.fit = {0.7, 0.02, 0.55, Eigen::Matrix<double, 9, 9>::Identity()};
  object.fit.covariance(3, 8) = 0.5;
  snapshot.objects = {object};
  snapshot.detections = {{{"cup", 0.75, {1.0, 2.0, 3.0, 4.0}}, 4}};
  snapshot.gravity_known = true;
  snapshot.support_height = 0.75;
  snapshot.progress = SnapshotProgress{250, 7.5, 80.25, {.loops = 2, .merges = 1}};
  snapshot.covisibility = {{3, 8, 120}, {3, 9, 15}};
  return snapshot;
}

}  // namespace sqslam::testing
