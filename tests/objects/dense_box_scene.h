#pragma once

#include <vector>

#include "slam/objects/dense_evidence.h"
#include "slam/objects/landmark.h"
#include "slam/objects/landmark_geometry.h"

namespace sqslam::testing {

// A box on a table before a wall, seen over a quarter of an arc; the map's z axis points up.
struct DenseBoxScene {
  Camera camera;
  PosedSuperquadric truth;
  std::vector<Rigid3d> poses;           // T_map_camera
  std::vector<SurfacePoint> faces;      // of the box, as far as the cameras see them
  std::vector<SurfacePoint> elsewhere;  // on the table and the wall

  DenseBoxScene() {
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
    for (double u = -0.98; u < 1.0; u += 0.07) {
      for (double v = -0.98; v < 1.0; v += 0.07) {
        faces.push_back({{0.12, 0.2 * u, 0.16 + 0.16 * v}, Eigen::Vector3d::UnitX()});
        faces.push_back({{0.12 * u, 0.2, 0.16 + 0.16 * v}, Eigen::Vector3d::UnitY()});
        faces.push_back({{0.12 * u, 0.2 * v, 0.32}, Eigen::Vector3d::UnitZ()});
      }
    }
    for (double u = -1.0; u <= 1.0; u += 0.02) {
      for (double v = -1.0; v <= 1.0; v += 0.02) {
        if (std::abs(u) > 0.13 || std::abs(v) > 0.21) {
          elsewhere.push_back({{u, v, 0.0}, Eigen::Vector3d::UnitZ()});
        }
        elsewhere.push_back({{-0.2, v, 1.0 + u}, Eigen::Vector3d::UnitX()});
      }
    }
  }

  Box2d Box(std::size_t i) const { return *ProjectToBox(truth, poses[i], camera); }

  // Half as deep as it is.
  PosedSuperquadric Plate() const {
    PosedSuperquadric plate = truth;
    plate.shape.half_size.x() *= 0.5;
    return plate;
  }

  std::vector<SurfacePoint> Cloud() const {
    std::vector<SurfacePoint> cloud = elsewhere;
    cloud.insert(cloud.end(), faces.begin(), faces.end());
    return cloud;
  }
};

}  // namespace sqslam::testing
