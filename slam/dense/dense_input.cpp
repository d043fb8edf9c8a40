#include "slam/dense/dense_input.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "slam/io/cameras.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

Sequence OpenImages(const fs::path& result, const fs::path& images, const RecordingInfo& info,
                    const Camera& camera) {
  const fs::path path = images.empty() ? fs::path(info.sequence_path) : images;
  try {
    return OpenSequence({.path = path, .known_camera = camera});
  } catch (const InputError& error) {
    throw InputError("{}: the mapped images are needed, expected them at {} or with --images ({})",
                     result.string(), path.string(), error.what());
  }
}

// Returns the poses of frames whose images exist.
std::vector<PosedFrame> FramesWithImages(const fs::path& result, const Sequence& sequence) {
  std::vector<PosedFrame> frames;
  std::vector<std::string> missing;
  for (const auto& [index, pose] : ReadPosesByFrame(result / "trajectory.txt", sequence)) {
    const fs::path& image = sequence.frames[static_cast<std::size_t>(index)].image_path;
    if (sequence.video_path.empty() && !fs::exists(image)) {
      missing.push_back(image.string());
    } else {
      frames.push_back({index, pose});
    }
  }
  if (frames.empty() && !missing.empty()) {
    throw InputError(
        "{}: none of the {} mapped images exists, such as {}, expected them there or with --images",
        result.string(), missing.size(), missing.front());
  }
  if (!missing.empty()) {
    spdlog::warn("{}: {} mapped images are missing, such as {}", result.string(), missing.size(),
                 missing.front());
  }
  return frames;
}

}  // namespace

void DenseInput::TakeMap(const MapSnapshot& map, double scale) {
  recorded = map.camera;
  camera = ResizedCamera(recorded, std::max(1, static_cast<int>(std::lround(recorded.width * scale))),
                         std::max(1, static_cast<int>(std::lround(recorded.height * scale))));
  camera = camera.WithoutDistortion();
  std::vector<SnapshotKeyframe> sorted = map.keyframes;
  std::ranges::sort(sorted, {}, &SnapshotKeyframe::frame_index);
  keyframes = ToVector(sorted, [](const SnapshotKeyframe& keyframe) {
    return PosedFrame{keyframe.frame_index, keyframe.T_map_camera};
  });
  ids = ToVector(sorted, &SnapshotKeyframe::id);
  points = PositionsOf(map);
}

DenseInput ReadDenseInput(const fs::path& result, const fs::path& images, const DenseOptions& options) {
  const RecordingReader recording(result / "map.sqmap");
  DenseInput input;
  input.TakeMap(*recording.Last(), options.scale);
  input.sequence = OpenImages(result, images, recording.Info(), input.recorded);
  input.frames = FramesWithImages(result, input.sequence);
  if (const fs::path used = result / "camera.yaml"; fs::exists(used)) {
    input.readout = 1e-3 * ReadCamera(used).readout_ms;
  }
  input.moving = MovingMask(result, input.sequence, options.moving_labels);
  return input;
}

}  // namespace sqslam
