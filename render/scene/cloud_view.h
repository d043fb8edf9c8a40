#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "render/camera/camera_path.h"
#include "render/gl/point_splats.h"
#include "render/scene/cloud_layer.h"

namespace sqslam {

// A dense cloud as splats, no more of them than a view can show: parts that lie outside are left out, and of
// each other part that level is drawn whose points are as far apart in the picture as asked for. For the
// sources of render/ only.
class CloudView {
 public:
  // A null cloud: none.
  void Show(const CloudLayerPtr& cloud);

  // Chooses what this view needs; `height` of the picture and `detail`, the least distance between points, in
  // samples. `newest`: frame of the map; what comes later is left out.
  void LookFrom(const ViewCamera& camera, double height, double aspect, double detail, std::int64_t newest);

  PointSplats& Splats() { return splats_; }

 private:
  struct Part {
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    double radius = 0.0;                           // of the ball around its points, map units
    int first = 0;                                 // of the vertices, those of the highest rank first
    std::array<int, CloudLayer::kRanks> counts{};  // of the levels
    std::int32_t frame = 0;                        // of its first point
  };

  double spacing_ = 0.0;
  std::vector<Part> parts_;
  PointSplats splats_;
};

}  // namespace sqslam
