#include "app/viewer/frames/run_frames.h"

#include <fmt/format.h>

#include <cmath>

#include "slam/io/trajectory.h"
#include "slam/util/error.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;
namespace {

constexpr double kSameTime = 1e-4;     // seconds; files have six digits
constexpr std::int64_t kReadOver = 8;  // frames that are decoded in vain rather than opening the file anew

}  // namespace

RunFrames::RunFrames(const RecordingReader& recording, const fs::path& map_file) {
  try {
    sequence_ = OpenSequence({.path = recording.Info().sequence_path, .camera = {}, .detections = {}});
  } catch (const std::exception& error) {  // moved, deleted, or a live camera
    why_no_images_ = error.what();
  }
  const fs::path file = map_file.parent_path() / "trajectory.txt";
  if (!sequence_ || !fs::exists(file)) {
    return;
  }
  try {
    std::size_t at = 0;
    const std::vector<SequenceFrame>& frames = sequence_->frames;
    for (const TimedPose& pose : ReadTrajectory(file)) {
      while (at < frames.size() && frames[at].timestamp < pose.timestamp - kSameTime) {
        ++at;
      }
      if (at < frames.size() && std::abs(frames[at].timestamp - pose.timestamp) <= kSameTime) {
        poses_[static_cast<std::int64_t>(at)] = pose.T_map_camera;
      }
    }
  } catch (const InputError&) {  // a broken file: the poses of the snapshots are left
    poses_.clear();
  }
}

RunFrames::~RunFrames() = default;

std::vector<Moment> RunFrames::Moments(const RecordingReader& recording, const MapSnapshot& last) const {
  std::vector<Moment> moments;
  const int snapshots = recording.Size();
  if (snapshots == 0) {
    return moments;
  }
  if (!sequence_) {
    std::map<std::int64_t, double> times;  // of keyframes, which most snapshots end with
    for (const SnapshotKeyframe& keyframe : last.keyframes) {
      times[keyframe.frame_index] = keyframe.timestamp;
    }
    for (int i = 0; i < snapshots; ++i) {
      const std::int64_t frame = recording.FrameIndex(i);
      const auto known = times.find(frame);
      double time = moments.empty() ? 0.0 : moments.back().timestamp;
      try {
        time = known != times.end() ? known->second : recording.Read(i)->timestamp;
      } catch (const InputError&) {  // damaged; said when it is to be shown
      }
      moments.push_back({frame, time, i});
    }
    return moments;
  }
  int snapshot = 0;
  const std::int64_t end = std::min<std::int64_t>(recording.FrameIndex(snapshots - 1) + 1,
                                                  static_cast<std::int64_t>(sequence_->frames.size()));
  for (std::int64_t frame = recording.FrameIndex(0); frame < end; ++frame) {
    while (snapshot + 1 < snapshots && recording.FrameIndex(snapshot + 1) <= frame) {
      ++snapshot;
    }
    moments.push_back({frame, sequence_->frames[static_cast<std::size_t>(frame)].timestamp, snapshot});
  }
  return moments;
}

std::optional<Rigid3d> RunFrames::PoseOf(std::int64_t frame) const {
  const auto found = poses_.find(frame);
  return found == poses_.end() ? std::nullopt : std::optional(found->second);
}

std::vector<Detection> RunFrames::BoxesOf(std::int64_t frame) const {
  const auto at = static_cast<std::size_t>(frame);
  return sequence_ && at < sequence_->frames.size() ? sequence_->frames[at].detections
                                                    : std::vector<Detection>();
}

cv::Mat RunFrames::ImageOf(std::int64_t frame) {
  if (!sequence_) {
    return {};
  }
  if (!source_ || frame < next_ || frame >= next_ + kReadOver) {
    source_ = std::make_unique<FrameSource>(*sequence_, FrameRange{.start = frame}, 2);
    next_ = frame;
  }
  while (std::optional<Frame> read = source_->Next()) {
    next_ = read->index + 1;
    if (read->index == frame) {
      return read->bgr;
    }
    if (read->index > frame) {
      break;  // it could not be read and was skipped
    }
  }
  return {};
}

}  // namespace sqslam::viewer
