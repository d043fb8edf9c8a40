#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "slam/objects/object_types.h"

namespace sqslam::testing {

// Ten superquadrics on a desk, seen from one side by a camera on an arc, as numbers: map points on the
// surfaces that face the camera (with noise, and points of the desk around), and boxes as a mediocre detector
// gives them. No image.
class SyntheticDesk {
 public:
  explicit SyntheticDesk(std::uint64_t seed, double box_noise = 0.03);

  static constexpr int kFrames = 120;

  struct Object {
    std::string label;
    PosedSuperquadric superquadric;
  };

  const std::vector<Object>& Objects() const { return objects_; }
  const sqslam::Camera& Camera() const { return camera_; }
  Rigid3d Pose(int frame) const;  // T_world_camera; world z up, desk at z = 0
  ObjectFrame Frame(int frame) const;
  std::optional<Eigen::Vector3d> Position(std::int64_t id) const;  // noisy, as mapped

 private:
  struct Point {
    Eigen::Vector3d truth;
    Eigen::Vector3d mapped;
    Eigen::Vector3d normal;
    int object = -1;
  };

  bool IsVisible(const Point& point, const Eigen::Vector3d& camera_centre) const;

  std::uint64_t seed_;
  double box_noise_;
  sqslam::Camera camera_;
  std::vector<Object> objects_;
  std::vector<Point> points_;
};

}  // namespace sqslam::testing
