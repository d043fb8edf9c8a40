#include "slam/dense/dense_input.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <string>

#include "slam/io/cameras.h"
#include "slam/io/input_images.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "slam/util/markup.h"
#include "slam/util/options.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;

MovingMask::MovingMask(const fs::path& result, const Sequence& sequence,
                       const std::vector<std::string>& labels) {
  const fs::path file = result / "boxes.txt";
  if (labels.empty() || !fs::exists(file)) {
    return;
  }
  const std::vector<std::vector<Detection>> frames = ReadFrameBoxes(file, sequence, false);
  const Camera& size = sequence.camera;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    for (const Detection& detection : frames[i]) {
      if (std::ranges::find(labels, detection.label) != labels.end()) {
        const Box2d& box = detection.box;
        boxes_[static_cast<std::int64_t>(i)].push_back(
            {box.x / size.width, box.y / size.height, box.width / size.width, box.height / size.height});
      }
    }
  }
}

void MovingMask::Apply(DepthMap& map) const {
  const auto boxes = boxes_.find(map.frame_index);
  if (boxes == boxes_.end()) {
    return;
  }
  for (const Box2d& box : boxes->second) {
    const cv::Point first(static_cast<int>(std::floor(box.x * map.depth.cols)),
                          static_cast<int>(std::floor(box.y * map.depth.rows)));
    const cv::Point end(static_cast<int>(std::ceil((box.x + box.width) * map.depth.cols)),
                        static_cast<int>(std::ceil((box.y + box.height) * map.depth.rows)));
    map.depth(cv::Rect(first, end) & cv::Rect({0, 0}, map.depth.size())).setTo(0.0F);
  }
}

namespace {

Sequence OpenImages(const fs::path& result, const fs::path& images, const RecordingReader& recording,
                    const Camera& camera) {
  const fs::path path = images.empty() ? fs::path(recording.Info().sequence_path) : images;
  try {
    Sequence sequence = OpenSequence({.path = path, .known_camera = camera});
    CheckNumbering(recording, sequence);
    return sequence;
  } catch (const InputError& error) {
    throw InputError("{}: the mapped images are needed, expected them at {} or with --images ({})",
                     result.string(), path.string(), error.what());
  }
}

void WarnOfKeyframesBeyond(const fs::path& result, const DenseInput& input) {
  const auto beyond = std::ranges::count_if(
      input.keyframes, [&](const PosedFrame& keyframe) { return !HasFrame(input.sequence, keyframe.index); });
  if (beyond > 0) {
    spdlog::warn("{}: {} of {} keyframes get no new depth, since they lie beyond the {} images of {}",
                 result.string(), beyond, input.keyframes.size(), input.sequence.frames.size(),
                 input.sequence.path.string());
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

void DenseInput::SetMap(const MapSnapshot& map, double scale) {
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
  input.SetMap(*recording.Last(), options.scale);
  input.sequence = OpenImages(result, images, recording, input.recorded);
  input.frames = FramesWithImages(result, input.sequence);
  WarnOfKeyframesBeyond(result, input);
  if (const fs::path used = result / "camera.yaml"; fs::exists(used)) {
    input.readout = 1e-3 * ReadCamera(used).readout_ms;
  }
  input.moving = MovingMask(result, input.sequence, options.moving_labels);
  return input;
}

namespace {

std::string SettingsOf(const DenseInput& input, const PosedFrame& keyframe, const KeyframePlan& plan,
                       const DenseOptions& options) {
  const auto numbers = [](const Rigid3d& pose) {
    return fmt::format("{} {}\n", fmt::join(pose.rotation.coeffs(), " "), fmt::join(pose.translation, " "));
  };
  const Camera& c = input.recorded;
  std::string text =
      EstimationSettings(options) + input.sequence.path.string() +
      fmt::format("\n{} {} {} {} {} {} {} {}\n{} {}\n", input.readout, c.width, c.height, c.fx, c.fy, c.cx,
                  c.cy, fmt::join(c.distortion, " "), plan.range->nearest, plan.range->farthest) +
      numbers(keyframe.T_map_camera);
  if (c.lens == LensModel::kFisheye) {
    text += "fisheye ";
  }
  for (const std::vector<std::size_t>* views : {&plan.views, &plan.fine}) {
    for (const std::size_t view : *views) {
      text += fmt::format("{} ", input.frames[view].index) + numbers(input.frames[view].T_map_camera);
    }
  }
  return Fingerprint(text);
}

}  // namespace

std::string EstimationSettings(const DenseOptions& options) {
  DenseOptions estimation = options;
  estimation.fusion = {};
  estimation.fill = {};
  estimation.surface = {};
  return Fingerprint(DumpOptions(estimation));
}

KeyframePlan PlanKeyframe(const DenseInput& input, std::size_t k, const DenseOptions& options) {
  constexpr std::size_t kSamples = 100;  // map points for choosing views
  constexpr std::size_t kNoLimit = 1U << 24U;
  constexpr double kSmallAngle = 3.0;  // degrees between the rays of the nearer pair of views
  constexpr double kLargeAngle = 6.0;  // of the farther pair
  constexpr double kFineAngle = 12.0;  // of the pair that refines planes together with the farther one
  const PosedFrame& keyframe = input.keyframes[k];
  const Rigid3d& pose = keyframe.T_map_camera;
  KeyframePlan plan;
  plan.range = RangeOf(PointsInView(input.points, input.camera, pose, kNoLimit), pose);
  plan.in_view = PointsInView(input.points, input.camera, pose, kSamples);
  plan.views = ChooseViews(keyframe, input.frames, plan.in_view, input.camera, {kLargeAngle, kSmallAngle},
                           options.views);
  plan.fine = ChooseViews(keyframe, input.frames, plan.in_view, input.camera, {kFineAngle, kLargeAngle},
                          options.views);
  if (plan.views.size() < 2) {
    plan.range.reset();
  }
  if (plan.range) {
    plan.settings = SettingsOf(input, keyframe, plan, options);
  }
  return plan;
}

std::vector<KeyframePlan> PlanKeyframes(const DenseInput& input, const DenseOptions& options) {
  std::vector<KeyframePlan> plans;
  for (std::size_t k = 0; k < input.keyframes.size(); ++k) {
    plans.push_back(PlanKeyframe(input, k, options));
  }
  return plans;
}

}  // namespace sqslam
