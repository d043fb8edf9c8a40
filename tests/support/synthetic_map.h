#pragma once

#include <cstdint>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/map/map.h"

namespace sqslam::testing {

struct SyntheticMapOptions {
  int keyframes = 6;
  int points = 300;
  double pixel_noise = 0.0;  // px, standard deviation
  std::uint64_t seed = 7;
};

// Exact poses and points, keyframes on an arc that look at a cloud around the origin, every point seen by
// every keyframe; one keypoint per point, in the same order in each keyframe; descriptors random but equal
// for a point.
struct SyntheticMap {
  Camera camera;
  std::vector<Rigid3d> T_camera_map;
  std::vector<Eigen::Vector3d> points;
  Map map;
};

SyntheticMap MakeSyntheticMap(const SyntheticMapOptions& options);

// Largest of: references from points to keyframes that are not returned, and the other way round. 0 in a
// sound map.
int CountBrokenReferences(const Map& map);

}  // namespace sqslam::testing
