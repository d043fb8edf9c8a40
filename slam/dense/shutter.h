#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/io/sequence.h"
#include "slam/io/trajectory.h"

namespace sqslam {

// Images of a camera that reads its rows one after the other, as they were had all rows been taken with the
// middle one, to which the poses belong. The motion within an image comes from the poses of the frames before
// and after, the depth of what it moves past from a plane through the inverse depths of the map points in
// view.
class ShutterCorrection {
 public:
  // `camera`: of the images to be corrected, without distortion. `readout`: seconds from the first to the
  // last row; 0: nothing is corrected.
  ShutterCorrection(const Camera& camera, double readout, const Sequence& sequence, PosesByFrame poses,
                    std::vector<Eigen::Vector3d> points);

  // The image of a frame, corrected; itself where its motion is not known.
  cv::Mat Apply(std::int64_t frame, const cv::Mat& image) const;

 private:
  Camera camera_;
  double readout_;
  std::vector<double> timestamps_;
  PosesByFrame poses_;
  std::vector<Eigen::Vector3d> points_;
};

}  // namespace sqslam
