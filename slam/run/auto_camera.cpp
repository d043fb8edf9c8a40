#include "slam/run/auto_camera.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "app/terminal/progress.h"
#include "slam/io/camera_yaml.h"
#include "slam/system.h"

namespace sqslam::app {
namespace {

constexpr std::int64_t kFirstFrames = 400;  // of the first maps: over ten seconds, a few for the program
constexpr int kPasses = 6;
constexpr double kSettled = 0.003;  // relative change of the focal length

std::string InWords(const Camera& camera) {
  return fmt::format("{:.1f} px ({:.1f} degrees across)", camera.fx,
                     HorizontalFieldOfView(camera) * 180.0 / std::numbers::pi);
}

// Objects know nothing of the camera, and boxes cost time.
SystemOptions LearningOptions(SystemOptions options) {
  options.deterministic = true;
  options.mapping.camera.what = "focal+radial";
  options.mapping.joint_objects.mode = "none";
  return options;
}

// What a map of these frames says; empty where there is none.
std::optional<LearntCamera> MapOnce(const Sequence& sequence, const FrameRange& range, const Camera& camera,
                                    const SystemOptions& options, const std::function<bool()>& stop,
                                    const std::function<void(std::int64_t)>& done) {
  System system(camera, options, [](const MapSnapshotPtr&) {});
  FrameSource source(sequence, range);
  std::int64_t played = 0;
  while (std::optional<Frame> frame = stop() ? std::nullopt : source.Next()) {
    frame->detections.clear();
    system.Process(*frame);
    done(++played);
  }
  return system.Finish().map.learnt_camera;
}

}  // namespace

void AutoCamera::Take(const LearntCamera& learnt_camera) {
  if (learnt_camera.trusted) {
    camera = learnt_camera.camera;
    focal_deviation = learnt_camera.focal_deviation;
    learnt = true;
  }
}

std::string AutoCamera::Text() const {
  const std::string radial =
      camera.distortion[0] != 0.0 ? fmt::format(", radial distortion k1 {:.3f}", camera.distortion[0]) : "";
  if (!learnt) {
    return fmt::format("camera: focal length {}, a guess from {}; the images do not tell it", InWords(camera),
                       guessed_by);
  }
  return fmt::format(
      "camera: focal length {}, standard deviation {:.1f} px by the points' scatter alone, rather one "
      "percent in "
      "all{}; the guess from {} was {:.1f} px",
      InWords(camera), focal_deviation, radial, guessed_by, guess.fx);
}

AutoCamera EstimateCamera(const Sequence& sequence, const FrameRange& range, const SystemOptions& options,
                          bool quiet, const std::function<bool()>& stop) {
  AutoCamera result{sequence.camera, sequence.guessed_by, sequence.camera};
  spdlog::warn("--camera auto: focal length {}, guessed from {}; sqslam calibrate gives a better one",
               InWords(sequence.camera), sequence.guessed_by);
  const SystemOptions learning = LearningOptions(options);
  std::int64_t available = range.SizeIn(sequence);
  FrameRange part = range;
  part.count = std::min(kFirstFrames, available);
  Progress progress(0, quiet);
  std::int64_t frames = 0;
  double focal = sequence.camera.fx;
  for (int pass = 1; pass <= kPasses && !stop(); ++pass) {
    std::int64_t played = 0;
    const auto learnt = MapOnce(sequence, part, result.camera, learning, stop, [&](std::int64_t done) {
      played = done;
      progress.Update(++frames, fmt::format("to learn the focal length, now {:.1f} px", result.camera.fx));
    });
    if (stop()) {
      break;
    }
    if (played < part.count &&
        !sequence.video_path.empty()) {  // the file ends early, and need not say so each time
      available = played;
      part.count = played;
    }
    if (!learnt || !learnt->trusted) {
      if (part.count == available) {
        break;
      }
      part.count = std::min(2 * part.count, available);
      continue;
    }
    result.Take(*learnt);
    if (std::abs(learnt->focal - focal) < kSettled * focal) {
      break;
    }
    focal = learnt->focal;
  }
  progress.Finish();
  if (!result.learnt && !stop()) {
    spdlog::warn(
        "--camera auto: the images do not tell the focal length (the camera must move sideways and turn, "
        "past "
        "things at several depths); the guess is kept");
  }
  return result;
}

void WriteUsedCamera(const std::filesystem::path& result, const Camera& camera, const AutoCamera* automatic) {
  WriteCamera(result / "camera.yaml", camera, automatic != nullptr ? automatic->Text() : "");
}

}  // namespace sqslam::app
