#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>

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

// As the program wrote it when points had neither anomaly nor rejected_by: a cup with two points, one its
// own.
inline std::string SnapshotOfVersion2() {
  constexpr std::string_view kHex =
      "400400000000000078016366800039280da11ed8b30219897a0579e90d4c0c0c0f18a1b20ef50e60560094662881f019"
      "f2a0b4259406abc24bc08cc4a1e8833d440246333840f81c601ae826206800a901610720db0e481d00d20e5c1a224672"
      "362c40e1ff4000b206c46606e2e4d202200907982e8059868b7e007514dc0834064c1f9af02877340406690880f2004a"
      "d6788137df313008388072132334efbcb00700232521df";
  std::string bytes;
  for (std::size_t i = 0; i < kHex.size(); i += 2) {
    bytes += static_cast<char>(std::stoi(std::string(kHex.substr(i, 2)), nullptr, 16));
  }
  return bytes;
}

inline void ExpectSnapshotOfVersion2(const MapSnapshot& snapshot) {
  EXPECT_EQ(snapshot.frame_index, 30);
  ASSERT_EQ(snapshot.points.size(), 2u);
  EXPECT_EQ(snapshot.points[0].p_map, Eigen::Vector3f(1.0F, 2.0F, -3.0F));
  EXPECT_EQ(snapshot.points[0].object_id, 4);
  EXPECT_EQ(snapshot.points[1].object_id, -1);
  for (const SnapshotPoint& point : snapshot.points) {
    EXPECT_EQ(point.anomaly, 0.0F);
    EXPECT_EQ(point.rejected_by, -1);
  }
  ASSERT_EQ(snapshot.objects.size(), 1u);
  EXPECT_EQ(snapshot.objects[0].superquadric.shape.e2, 0.5);
  ASSERT_EQ(snapshot.detections.size(), 1u) << "what comes after the points is read from its place";
  EXPECT_EQ(snapshot.detections[0].detection.box.height, 4.0);
  EXPECT_EQ(snapshot.support_height, 0.75);
}

}  // namespace sqslam::testing
