#pragma once

#include <vector>

#include "slam/geometry/camera.h"
#include "slam/map/map.h"

namespace sqslam::testing {

struct RingMapOptions {
  int keyframes = 28;            // 15 degrees apart, so that the last ones see again what the first saw
  double scale_drift = 3e-4;     // logarithm of the scale, per degree of the way
  double rotation_drift = 0.03;  // degrees per degree
  KeyframeId first_id = 0;       // of the keyframes; of the points, a thousand times that
};

// A camera that turned on a ring, looking outward at a wall of points, and did not notice that it came back:
// what it saw twice are two map points, and the map is bent by drift.
struct RingMap {
  Camera camera;
  std::vector<Rigid3d> T_world_camera;  // the truth, by keyframe
  Map map;
};

RingMap MakeRingMap(const RingMapOptions& options);

// Root mean square distance of the keyframes' centres from the truth after the best similarity transform.
double CenterError(const RingMap& ring);

}  // namespace sqslam::testing
