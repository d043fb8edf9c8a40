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

// A frame as stereo takes it: in the size of the depth maps, without distortion.
struct DenseImage {
  cv::Mat bgr;   // 8UC3; empty but for keyframes
  cv::Mat gray;  // 8UC1
};

// Images of a sequence for jobs that each need a few frames near each other and are begun in the order of
// their first frames: read once, in order, and forgotten when the last job that needs them has them. For any
// number of threads.
class ImageFeed {
 public:
  // `camera`: of the images that are handed out. `shutter` must outlive the feed. `jobs`: the frames that
  // each job needs, the keyframe first.
  ImageFeed(const Sequence& sequence, const Camera& camera, const ShutterCorrection& shutter,
            const std::vector<std::vector<std::int64_t>>& jobs);

  // The next job, with its images by frame; those that cannot be read are not among them. Empty after the
  // last.
  struct Job {
    std::size_t index;
    std::map<std::int64_t, DenseImage> images;
  };
  std::optional<Job> Next();

 private:
  DenseImage Prepare(std::int64_t index, const Frame& frame) const;

  std::vector<std::vector<std::int64_t>> jobs_;
  std::vector<std::int64_t> frames_;  // those that the source gives, by their index there
  Camera camera_;
  const ShutterCorrection& shutter_;
  cv::Mat places_x_, places_y_;  // 32FC1, in the resized image as recorded; empty without distortion
  std::mutex mutex_;             // guards the rest
  std::set<std::int64_t> keyframes_;
  std::map<std::int64_t, int> uses_;  // jobs to come, of each frame
  std::map<std::int64_t, DenseImage> images_;
  FrameSource source_;
  std::int64_t read_ = -1;  // the last frame that was read
  std::size_t next_ = 0;    // job
};

// Sequence without the frames that no job needs; those of a video are all left in.
Sequence WithFrames(const Sequence& sequence, const std::vector<std::int64_t>& frames);

}  // namespace sqslam
