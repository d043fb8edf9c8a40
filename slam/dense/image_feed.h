#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <vector>

#include "slam/dense/shutter.h"
#include "slam/geometry/camera.h"
#include "slam/io/frame_source.h"
#include "slam/io/sequence.h"

namespace sqslam {

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

  // Returns the next job with its images by frame, without unreadable ones; nothing after the last.
  struct Job {
    std::size_t index;
    std::map<std::int64_t, DenseImage> images;
  };
  std::optional<Job> Next();

 private:
  DenseImage Prepare(std::int64_t index, const Frame& frame) const;

  std::vector<std::vector<std::int64_t>> jobs_;
  std::vector<std::int64_t> frames_;  // that the source yields, by their index there
  Camera camera_;
  const ShutterCorrection& shutter_;
  cv::Mat places_x_, places_y_;  // 32FC1, in the resized distorted image; empty without distortion
  std::mutex mutex_;             // guards the rest
  std::set<std::int64_t> keyframes_;
  std::map<std::int64_t, int> uses_;  // remaining jobs that need each frame
  std::map<std::int64_t, DenseImage> images_;
  FrameSource source_;
  std::int64_t read_ = -1;  // the last frame read
  std::size_t next_ = 0;    // index of the next job
};

// Returns the sequence with these frames only.
Sequence WithFrames(const Sequence& sequence, const std::vector<std::int64_t>& frames);

}  // namespace sqslam
