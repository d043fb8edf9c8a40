#include "render/video/input_frames.h"

#include <iterator>

#include "render/video/video_alignment.h"
#include "slam/io/trajectory.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;

InputFrames::InputFrames(const RecordingReader& recording, const fs::path& map_file) : images_(recording) {
  const MapSnapshotPtr last = recording.Last();
  if (const Sequence* sequence = images_.FindSequence()) {
    poses_ = ReadPosesByFrame(map_file.parent_path() / "trajectory.txt", *sequence);
  }
  // Without a trajectory: poses of the keyframes, then of the snapshots' newest frames.
  PosesByFrame recorded;
  for (const SnapshotKeyframe& keyframe : last->keyframes) {
    recorded.emplace(keyframe.frame_index, keyframe.T_map_camera);
  }
  for (int i = 0; i < recording.Size(); ++i) {
    const MapSnapshotPtr map = recording.Read(i);
    if (!map->image_path.empty()) {
      files_.emplace(map->frame_index, map->image_path);
    }
    if (map->T_map_camera) {
      recorded.emplace(map->frame_index, AlignByKeyframes(*map, *last) * *map->T_map_camera);
    }
  }
  poses_ = poses_.empty() ? recorded : poses_;
}

Rigid3d InputFrames::PoseOf(std::int64_t frame) const {
  ThrowIf<UsageError>(poses_.empty(), "frame {}: the map has no poses of its camera", frame);
  auto nearest = poses_.lower_bound(frame);
  if (nearest != poses_.end() && nearest->first == frame) {
    return nearest->second;
  }
  if (nearest == poses_.end() ||
      (nearest != poses_.begin() && frame - std::prev(nearest)->first <= nearest->first - frame)) {
    --nearest;
  }
  throw UsageError(
      "frame {}: its pose is not known, expected one of the {} tracked frames from {} to {}; the "
      "nearest is {}",
      frame, poses_.size(), poses_.begin()->first, poses_.rbegin()->first, nearest->first);
}

cv::Mat InputFrames::ImageOf(std::int64_t frame) {
  cv::Mat image = images_.Read(files_, frame);
  ThrowIf<InputError>(image.empty(),
                      "frame {}: its image is not there, expected the sequence that was mapped ({})", frame,
                      images_.WhyNot());
  return image;
}

}  // namespace sqslam
