#pragma once

#include <vector>

#include "slam/objects/landmark.h"
#include "slam/objects/landmark_geometry.h"

namespace sqslam::testing {

// A box on a table, seen over a quarter of an arc; the map's z axis points up.
struct BoxScene {
  Camera camera;
  PosedSuperquadric truth;
  std::vector<Rigid3d> poses;  // T_map_camera

  BoxScene() {
    camera.width = 640;
    camera.height = 480;
    camera.fx = camera.fy = 520.0;
    camera.cx = 320.0;
    camera.cy = 240.0;
    truth.shape = {{0.12, 0.2, 0.16}, 0.1, 0.1};
    truth.T_map_object.translation = {0.0, 0.0, 0.16};
    for (int i = 0; i < 40; ++i) {
      const double angle = 0.6 + 0.02 * i;
      const Eigen::Vector3d eye(1.6 * std::cos(angle), 1.6 * std::sin(angle), 0.7);
      const Eigen::Vector3d z = (truth.T_map_object.translation - eye).normalized();
      const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
      Eigen::Matrix3d R;
      R << x, z.cross(x), z;
      poses.push_back({Eigen::Quaterniond(R), eye});
    }
  }

  Box2d Box(std::size_t i) const { return *ProjectToBox(truth, poses[i], camera); }
};

}  // namespace sqslam::testing
