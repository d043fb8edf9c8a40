#include "app/result/input_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "render/video/video_alignment.h"
#include "slam/io/frame_source.h"
#include "slam/io/image_resize.h"
#include "slam/io/trajectory.h"
#include "slam/util/error.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr double kSameTime = 1e-4;  // seconds; files have six digits

}  // namespace

InputFrames::InputFrames(const RecordingReader& recording, const fs::path& map_file) {
  camera_ = recording.Last()->camera;
  try {
    SequenceRequest request;
    request.path = recording.Info().sequence_path;
    request.known_camera = camera_;
    sequence_ = OpenSequence(request);
  } catch (const InputError& error) {
    why_no_sequence_ = error.what();
  } catch (const UsageError& error) {
    why_no_sequence_ = error.what();
  }
  TakeTrajectory(map_file);
  TakeRecording(recording);
}

// Lines of the trajectory are frames by their times.
void InputFrames::TakeTrajectory(const fs::path& map_file) {
  const fs::path file = map_file.parent_path() / "trajectory.txt";
  if (!sequence_ || !fs::exists(file)) {
    return;
  }
  std::size_t at = 0;
  for (const TimedPose& pose : ReadTrajectory(file)) {
    while (at < sequence_->frames.size() && sequence_->frames[at].timestamp < pose.timestamp - kSameTime) {
      ++at;
    }
    if (at < sequence_->frames.size() &&
        std::abs(sequence_->frames[at].timestamp - pose.timestamp) <= kSameTime) {
      tracked_.push_back({static_cast<std::int64_t>(at), pose.T_map_camera});
    }
  }
}

// Poses without a trajectory: of keyframes, then of the newest frames of the snapshots.
void InputFrames::TakeRecording(const RecordingReader& recording) {
  std::map<std::int64_t, Rigid3d> poses;
  const MapSnapshotPtr last = recording.Last();
  for (const SnapshotKeyframe& keyframe : last->keyframes) {
    poses.emplace(keyframe.frame_index, keyframe.T_map_camera);
  }
  for (int i = 0; i < recording.Size(); ++i) {
    const MapSnapshotPtr map = recording.Read(i);
    images_.emplace_back(map->frame_index, map->image_path);
    if (map->T_map_camera) {
      const Sim3d s = AlignByKeyframes(*map, *last);
      poses.emplace(map->frame_index,
                    Rigid3d{s.rotation * map->T_map_camera->rotation, s * map->T_map_camera->translation});
    }
  }
  if (tracked_.empty()) {
    for (const auto& [index, pose] : poses) {
      tracked_.push_back({index, pose});
    }
  }
}

Rigid3d InputFrames::PoseOf(std::int64_t frame) const {
  if (tracked_.empty()) {
    throw UsageError(fmt::format("frame {}: the map has no poses of its camera", frame));
  }
  const auto found =
      std::lower_bound(tracked_.begin(), tracked_.end(), frame,
                       [](const TrackedFrame& tracked, std::int64_t index) { return tracked.index < index; });
  if (found != tracked_.end() && found->index == frame) {
    return found->T_map_camera;
  }
  const auto after = found == tracked_.end() ? found - 1 : found;
  const auto before = found == tracked_.begin() ? found : found - 1;
  const std::int64_t nearest =
      std::abs(before->index - frame) <= std::abs(after->index - frame) ? before->index : after->index;
  throw UsageError(
      fmt::format("frame {}: its pose is not known, expected one of the {} tracked frames from {} to {}; the "
                  "nearest is {}",
                  frame, tracked_.size(), tracked_.front().index, tracked_.back().index, nearest));
}

cv::Mat InputFrames::ImageOf(std::int64_t frame) const {
  for (const auto& [index, path] : images_) {
    if (index == frame && !path.empty()) {
      if (cv::Mat image = ReadImageInSize(path, {camera_.width, camera_.height}); !image.empty()) {
        return image;
      }
    }
  }
  if (!sequence_) {
    throw InputError(
        fmt::format("frame {}: its image is not there, expected the sequence that was mapped ({})", frame,
                    why_no_sequence_));
  }
  FrameSource source(*sequence_, {.start = frame, .count = 1});
  const std::optional<Frame> read = source.Next();
  if (!read || read->bgr.empty()) {
    throw InputError(fmt::format("{}: frame {} cannot be read", sequence_->path.string(), frame));
  }
  return read->bgr;
}

}  // namespace sqslam::app
