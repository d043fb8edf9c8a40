#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/viewer/frames/timeline.h"
#include "slam/io/frame_source.h"
#include "slam/io/sequence.h"
#include "slam/snapshot/recording.h"

namespace sqslam::viewer {

// The frames that went into a recording, as far as they can still be found: their times, images and boxes in
// the sequence that was mapped, their poses in trajectory.txt beside the recording.
class RunFrames {
 public:
  // Never fails: what is not there is left out, and WhyNoImages() says so.
  RunFrames(const RecordingReader& recording, const std::filesystem::path& map_file);
  ~RunFrames();

  // Every frame from the first snapshot to the last; the snapshots alone where the sequence is gone.
  std::vector<Moment> Moments(const RecordingReader& recording, const MapSnapshot& last) const;

  // T_map_camera in the finished map.
  std::optional<Rigid3d> PoseOf(std::int64_t frame) const;
  std::vector<Detection> BoxesOf(std::int64_t frame) const;

  // 8UC3, or empty. Frames in rising order are read fastest.
  cv::Mat ImageOf(std::int64_t frame);
  const std::string& WhyNoImages() const { return why_no_images_; }

 private:
  std::optional<Sequence> sequence_;
  std::map<std::int64_t, Rigid3d> poses_;
  std::unique_ptr<FrameSource> source_;
  std::int64_t next_ = 0;  // frame that source_ gives next
  std::string why_no_images_;
};

}  // namespace sqslam::viewer
