#include "slam/run/auto_camera.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace sqslam {
namespace {

constexpr std::int64_t kFirstPassFrames = 400;  // of the first passes: over ten seconds of video
constexpr int kMaxPasses = 6;
constexpr double kMaxFocalChange = 0.003;  // relative change of the focal length

std::string InWords(const Camera& camera) {
  return fmt::format("{:.1f} px ({:.1f} degrees across)", camera.fx,
                     HorizontalFieldOfView(camera) * 180.0 / std::numbers::pi);
}

// Leaves objects out: they don't constrain the camera, and boxes cost time.
SystemOptions LearningOptions(SystemOptions options) {
  options.deterministic = true;
  options.mapping.camera.what = LearntPart::kFocalAndRadial;
  options.mapping.joint_objects.mode = JointMode::kNone;
  return options;
}

struct LearningPass {
  std::optional<LearntCamera> learnt;  // empty if there is no map
  std::int64_t played = 0;             // frames
};

LearningPass MapOnce(const Sequence& sequence, const FrameRange& range, const Camera& camera,
                     const SystemOptions& options, std::int64_t done, RunHost& host) {
  System system(camera, options, [](const MapSnapshotPtr&) {});
  FrameSource source(sequence, range);
  LearningPass pass;
  while (std::optional<Frame> frame = host.Stopped() ? std::nullopt : source.Next()) {
    frame->detections.clear();
    system.Process(*frame);
    host.ShowProgress(
        done + ++pass.played, 0,
        fmt::format("estimating the focal length, now {:.1f} px", InFilePixels(camera, sequence).fx));
  }
  pass.learnt = system.Finish([&host] { return host.Stopped(); }).map.learnt_camera;
  return pass;
}

}  // namespace

void AutoCamera::Adopt(const LearntCamera& learnt_camera) {
  if (learnt_camera.trusted) {
    camera = learnt_camera.camera;
    focal_deviation = learnt_camera.focal_deviation;
    learnt = true;
  }
}

AutoCamera AutoCamera::InFiles(const Sequence& sequence) const {
  AutoCamera in_files = *this;
  in_files.guess = InFilePixels(guess, sequence);
  in_files.camera = InFilePixels(camera, sequence);
  in_files.focal_deviation *= static_cast<double>(in_files.camera.width) / camera.width;
  return in_files;
}

std::string AutoCamera::Text() const {
  if (!IsGuessed()) {
    return "";
  }
  if (!learnt) {
    return fmt::format("camera: focal length {}, a guess from {}; the images do not determine it",
                       InWords(camera), guessed_by);
  }
  const std::string radial =
      camera.distortion[0] != 0.0 ? fmt::format(", radial distortion k1 {:.3f}", camera.distortion[0]) : "";
  return fmt::format(
      "camera: focal length {}, standard deviation {:.1f} px from the scatter of the points alone, about one "
      "percent in all{}; the guess from {} was {:.1f} px",
      InWords(camera), focal_deviation, radial, guessed_by, guess.fx);
}

AutoCamera LearnCamera(const Sequence& sequence, const FrameRange& range, const SystemOptions& options,
                       RunHost& host) {
  AutoCamera result{sequence.camera, sequence.guessed_by, sequence.camera};
  std::int64_t available = range.SizeIn(sequence);
  if (!result.IsGuessed() || available == 0) {  // known, or the images of a live camera are yet to come
    return result;
  }
  spdlog::warn("--camera auto: focal length {}, guessed from {}; sqslam calibrate gives a better one",
               InWords(InFilePixels(sequence.camera, sequence)), sequence.guessed_by);
  const SystemOptions learning = LearningOptions(options);
  FrameRange part = range;
  part.count = std::min(kFirstPassFrames, available);
  std::int64_t frames = 0;
  double focal = sequence.camera.fx;
  for (int i = 0; i < kMaxPasses && !host.Stopped(); ++i) {
    const LearningPass pass = MapOnce(sequence, part, result.camera, learning, frames, host);
    if (host.Stopped()) {
      break;
    }
    frames += pass.played;
    if (pass.played < part.count && !sequence.video_path.empty()) {
      available = part.count = pass.played;  // the file ends early: warn only once
    }
    if (pass.learnt && pass.learnt->trusted) {
      result.Adopt(*pass.learnt);
      if (std::abs(pass.learnt->focal - focal) < kMaxFocalChange * focal) {
        break;
      }
      focal = pass.learnt->focal;
    } else if (part.count < available) {
      part.count = std::min(2 * part.count, available);
    } else {
      break;
    }
  }
  host.EndProgress();
  if (!result.learnt && !host.Stopped()) {
    spdlog::warn(
        "--camera auto: the images do not determine the focal length (the camera must move sideways and "
        "turn, past things at several depths); the guess is kept");
  }
  return result;
}

}  // namespace sqslam
