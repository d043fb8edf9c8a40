#include "slam/run/auto_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "slam/run/frames_ahead.h"
#include "slam/system.h"
#include "slam/util/stopwatch.h"

namespace sqslam {
namespace {

std::string InWords(const Camera& camera) {
  return fmt::format("{:.1f} px ({:.1f} degrees across)", camera.fx,
                     HorizontalFieldOfView(camera) * 180.0 / std::numbers::pi);
}

std::string IntervalText(double focal, double deviation) {
  const auto [low, high] = FocalInterval(focal, deviation);
  return fmt::format("95 %: {:.1f} to {:.1f} px", low, high);
}

// Leaves objects out: they don't constrain the camera, and boxes cost time. So does the search for places of
// many frames that were lost: a set of photographs needs it, a film has others. Half of the images are
// enough.
SystemOptions LearningOptions(SystemOptions options, const Sequence& sequence) {
  constexpr int kMaxCompleted = 60;
  constexpr double kMinMapped = 0.5;
  options.in_step = true;
  options.mapping.camera.what = LearntPart::kFocalAndRadial;
  options.mapping.camera.prior = {sequence.camera.fx, sequence.guess_deviation};
  options.mapping.joint_objects.mode = JointMode::kNone;
  options.mapping.completion.max_frames = std::min(options.mapping.completion.max_frames, kMaxCompleted);
  options.mapping.completion.min_mapped = kMinMapped;
  return options;
}

// Maps frames with the best camera so far.
class LearningRun {
 public:
  LearningRun(const Sequence& sequence, const SystemOptions& options, RunHost& host)
      : sequence_(sequence), options_(LearningOptions(options, sequence)), host_(host) {}

  // `planned`: frames that are certain to be played in all.
  void Map(const FrameRange& frames, std::int64_t planned, AutoCamera& camera) {
    System system(camera.camera, options_, [](const MapSnapshotPtr&) {});
    FrameSource source(sequence_, frames);
    FramesAhead ahead(source, system, false);
    while (const std::optional<Frame> frame = host_.Stopped() ? std::nullopt : ahead.Next()) {
      system.Process(*frame);
      host_.ShowProgress(++played_, planned,
                         fmt::format("estimating the focal length, now {:.1f} px",
                                     InFilePixels(camera.camera, sequence_).fx));
    }
    const RunResult result = system.Finish([this] { return host_.Stopped(); });
    if (result.map.learnt_camera && !host_.Stopped()) {
      camera.Adopt(*result.map.learnt_camera);
      camera.camera.readout_ms = 1e3 * result.readout;
    }
  }

  std::int64_t Played() const { return played_; }

 private:
  const Sequence& sequence_;
  SystemOptions options_;
  RunHost& host_;
  std::int64_t played_ = 0;
};

}  // namespace

bool AutoCamera::IsVague() const {
  constexpr double kMaxDeviation = 0.02;
  return deviation > kMaxDeviation;
}

void AutoCamera::Adopt(const LearntCamera& learnt_camera) {
  if (learnt_camera.trusted) {
    camera = learnt_camera.camera;
    deviation = learnt_camera.deviation;
    learnt = true;
  }
}

AutoCamera AutoCamera::InFiles(const Sequence& sequence) const {
  AutoCamera in_files = *this;
  in_files.guess = InFilePixels(guess, sequence);
  in_files.camera = InFilePixels(camera, sequence);
  return in_files;
}

std::string AutoCamera::Text() const {
  if (!IsGuessed()) {
    return "";
  }
  const std::string focal =
      fmt::format("camera: focal length {}, {}", InWords(camera), IntervalText(camera.fx, deviation));
  const std::string remedy = "the camera must move sideways past things at several depths, or be calibrated";
  if (!learnt) {
    return fmt::format("{}, a guess from {}; the images do not determine the focal length: {}", focal,
                       guessed_by, remedy);
  }
  const std::string radial =
      camera.distortion[0] != 0.0
          ? fmt::format(", radial distortion k1 {:.3f} k2 {:.3f}", camera.distortion[0], camera.distortion[1])
          : "";
  return fmt::format("{}{}; the guess from {} was {:.1f} px{}", focal, radial, guessed_by, guess.fx,
                     IsVague() ? "; the images determine it poorly: " + remedy : "");
}

LearningFrames ChooseLearningFrames(const FrameRange& range, std::int64_t available, double fps) {
  constexpr double kFps = 10.0;             // parallax grows with time, not with the number of frames
  constexpr std::int64_t kMinFrames = 50;   // of the second part, if there are as many
  constexpr std::int64_t kMaxFrames = 600;  // of the second part: the first minute
  constexpr std::int64_t kMinFirst = 50;    // of the first part
  constexpr std::int64_t kMaxPasses = 5;    // of the second part
  constexpr std::int64_t kShortSet = 200;   // frames that may be played in all, even of fewer images
  LearningFrames frames;
  frames.second = ThinnedRange(range, available, fps, kFps, kMinFrames);
  frames.second.count = std::min(frames.second.count, kMaxFrames);
  frames.first = frames.second;
  frames.first.count = std::min(std::max(kMinFirst, frames.second.count / 2), frames.second.count);
  if (frames.first.count + frames.second.count > available) {
    frames.first.count = 0;
  }
  frames.most =
      std::min(std::max(available, kShortSet), kMaxPasses * frames.second.count + frames.first.count);
  return frames;
}

bool IsSettled(const AutoCamera& before, const AutoCamera& after) {
  constexpr double kMaxChange = 0.5;  // deviations; as much again may still be missing
  return std::abs(std::log(after.camera.fx / before.camera.fx)) <= kMaxChange * after.deviation;
}

AutoCamera LearnCamera(const Sequence& sequence, const FrameRange& range, const SystemOptions& options,
                       RunHost& host) {
  AutoCamera result{sequence.camera, sequence.guessed_by, sequence.guess_deviation, sequence.camera,
                    sequence.guess_deviation};
  const std::int64_t available = range.SizeIn(sequence);
  if (!result.IsGuessed() || available == 0) {  // known, or the images of a live camera are yet to come
    return result;
  }
  // The result says how well the images determine it, and warns if they don't.
  host.Say(fmt::format("no calibration: focal length {}, guessed from {}, is estimated from the images first",
                       InWords(InFilePixels(sequence.camera, sequence)), sequence.guessed_by));
  const Stopwatch stopwatch;
  const LearningFrames frames = ChooseLearningFrames(range, available, sequence.camera.fps);
  LearningRun run(sequence, options, host);
  if (frames.first.count > 0) {
    run.Map(frames.first, frames.first.count + frames.second.count, result);
  }
  for (bool settled = false; !settled && !host.Stopped() && frames.Allow(run.Played());) {
    const AutoCamera before = result;
    run.Map(frames.second, run.Played() + frames.second.count, result);
    settled = IsSettled(before, result);
  }
  host.EndProgress();
  if (!host.Stopped()) {
    const AutoCamera in_files = result.InFiles(sequence);
    host.Say(fmt::format("focal length {}, {}, from {} frames in {:.0f} s", InWords(in_files.camera),
                         IntervalText(in_files.camera.fx, in_files.deviation), run.Played(),
                         stopwatch.Seconds()));
  }
  return result;
}

}  // namespace sqslam
