#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/io/frame.h"

namespace sqslam::testing {

// A small world that is rendered with exact geometry by plain OpenCV: textured upright panels at several
// depths in front of a textured wall. Map frame as the first camera: x right, y down, z forward.
class TexturedWorld {
 public:
  TexturedWorld() : TexturedWorld({320, 240, 260.0, 260.0, 160.0, 120.0}) {}
  explicit TexturedWorld(const Camera& pinhole);
  const Camera& GetCamera() const { return camera_; }
  Frame Render(std::int64_t index, const Rigid3d& T_map_camera) const;

  // The four corners of one of its panels, from far to near.
  std::array<Eigen::Vector3d, 4> PanelCorners(std::size_t panel) const {
    const Panel& p = panels_.at(panel);
    return {p.corner, p.corner + p.right, p.corner + p.right + p.down, p.corner + p.down};
  }

 private:
  struct Panel {
    Eigen::Vector3d corner;  // top left
    Eigen::Vector3d right;   // along the texture's u, whole width
    Eigen::Vector3d down;    // along v, whole height
    cv::Mat texture;
  };
  Camera camera_;
  std::vector<Panel> panels_;  // far to near
};

// Distorts frames of a pinhole camera as a lens at the same place would; black outside the pinhole's image.
class ThroughLens {
 public:
  ThroughLens(const Camera& lens, const Camera& pinhole);
  Frame operator()(const Frame& frame) const;

 private:
  cv::Mat from_;  // the camera's pixel of each pixel of the lens
};

// Sideways and forward motion with a little rotation, `count` poses, 1 cm to 2 cm apart at depths of 1 to 4.
std::vector<Rigid3d> HandHeldPath(int count);

// Root mean square distance of the camera centres after the best similarity transform.
double AlignedError(const std::vector<Eigen::Vector3d>& estimate, const std::vector<Eigen::Vector3d>& truth);

}  // namespace sqslam::testing
