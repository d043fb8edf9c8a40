#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/io/sequence.h"
#include "slam/io/trajectory.h"

namespace sqslam {

// Corrects images of a rolling shutter as if all rows had been taken with the middle one, to which the poses
// belong. The motion comes from the poses of the frames before and after, the scene depth from a plane
// through the inverse depths of the map points in view.
class ShutterCorrection {
 public:
  // `camera`: of the images to correct, without distortion. `readout`: seconds from the first to the last
  // row; 0: no correction.
  ShutterCorrection(const Camera& camera, double readout, const Sequence& sequence, PosesByFrame poses,
                    std::vector<Eigen::Vector3d> points);

  // Returns the corrected image of a frame, or the same image if its motion is unknown.
  cv::Mat Apply(std::int64_t frame, const cv::Mat& image) const;

 private:
  Camera camera_;
  double readout_;
  std::vector<double> timestamps_;
  PosesByFrame poses_;
  std::vector<Eigen::Vector3d> points_;
};

}  // namespace sqslam
