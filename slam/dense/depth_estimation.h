#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <vector>

#include "slam/dense/dense_input.h"
#include "slam/geometry/camera.h"
#include "slam/io/frame_source.h"
#include "slam/io/sequence.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/depth_map.h"

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

// A frame for stereo: in the size of the depth maps, without distortion.
struct DenseImage {
  cv::Mat bgr;   // 8UC3; of keyframes only
  cv::Mat gray;  // 8UC1
};

// Serves images of a sequence to jobs that each need a few nearby frames and begin in the order of their
// first frames. Each image is read once, in order, and released after the last job that needs it.
// Thread-safe.
class ImageFeed {
 public:
  // `camera`: of the served images. `shutter` must outlive the feed. `jobs`: the frames that each job needs,
  // the keyframe first.
  ImageFeed(const Sequence& sequence, const Camera& camera, const ShutterCorrection& shutter,
            const std::vector<std::vector<std::int64_t>>& jobs);

  // Returns the next job with its images by frame, without unreadable ones. Call it once for each job.
  struct Job {
    std::size_t index;
    std::map<std::int64_t, DenseImage> images;
  };
  Job Next();

 private:
  DenseImage Prepare(std::int64_t index, const Frame& frame) const;

  std::vector<std::vector<std::int64_t>> jobs_;
  std::vector<std::int64_t> frames_;  // that the source yields, by their index there
  Camera camera_;
  const ShutterCorrection& shutter_;
  cv::Mat places_x_, places_y_;  // 32FC1, in the resized distorted image; empty without distortion
  std::set<std::int64_t> keyframes_;
  std::map<std::int64_t, std::size_t> last_jobs_;  // that need each frame
  std::mutex mutex_;                               // guards the rest
  std::map<std::int64_t, DenseImage> images_;
  FrameSource source_;
  std::int64_t read_ = -1;  // the last frame read
  std::size_t next_ = 0;    // index of the next job
};

// Receives the depth map of a keyframe (a position in DenseInput::keyframes), empty if its images cannot be
// read. Returns false to stop.
using TakeDepthMap = std::function<bool(std::size_t keyframe, const std::optional<DepthMap>& map)>;

// Estimates the depth of the keyframes `jobs` by their plans, on up to `threads` threads (0: all hardware
// threads) within 400 MB. Calls `take` on these threads, one call at a time, in the order in which maps
// become ready; the maps don't depend on the number of threads. Returns false if `take` stopped it; rethrows
// what `take` or a thread threw.
bool EstimateDepthMaps(const DenseInput& input, const std::vector<KeyframePlan>& plans,
                       const std::vector<std::size_t>& jobs, const StereoOptions& options, int threads,
                       const TakeDepthMap& take);

}  // namespace sqslam
