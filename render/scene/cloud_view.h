#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "render/camera/camera_path.h"
#include "render/gl/point_splats.h"
#include "render/scene/cloud_layer.h"

namespace sqslam {

// Draws a dense cloud as splats with level of detail: skips parts outside the view, and draws each other part
// at the level that gives the requested point distance in the picture. For the sources of render/ only.
class CloudView {
 public:
  // Sets the cloud; null: none.
  void Show(const CloudLayerPtr& cloud);

  // Selects parts and levels for a view. `height` of the picture and `detail`, the minimum distance of
  // points, are in samples. `newest`: frame of the map; parts that start later are left out.
  void LookFrom(const ViewCamera& camera, double height, double aspect, double detail, std::int64_t newest);

  PointSplats& Splats() { return splats_; }

 private:
  struct Part {
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    double radius = 0.0;                           // of the bounding sphere, map units
    int first = 0;                                 // first vertex; vertices are sorted by descending rank
    std::array<int, CloudLayer::kRanks> counts{};  // vertices of each level
    std::int32_t frame = 0;                        // of its first point
  };

  double spacing_ = 0.0;
  std::vector<Part> parts_;
  PointSplats splats_;
};

}  // namespace sqslam
