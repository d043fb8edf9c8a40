#include "slam/run/auto_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "slam/mapping/feature_database.h"
#include "slam/run/frames_ahead.h"
#include "slam/system.h"
#include "slam/util/stopwatch.h"

namespace sqslam {
namespace {

constexpr double kVagueGuess = 0.2;  // deviation of a guess that knows nothing about the camera

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
SystemOptions LearningOptions(SystemOptions options, const AutoCamera& camera) {
  constexpr int kMaxCompleted = FeatureDatabase::kMaxImages;
  constexpr double kMinMapped = 0.5;
  options.in_step = true;
  options.mapping.camera.what = LearntPart::kFocalAndRadial;
  options.mapping.camera.prior = {camera.guess.fx, camera.guess_deviation};
  options.mapping.joint_objects.mode = JointMode::kNone;
  options.mapping.completion.max_frames = std::min(options.mapping.completion.max_frames, kMaxCompleted);
  options.mapping.completion.min_mapped = kMinMapped;
  options.mapping.camera.max_deviation = 1.0;  // a poor estimate is better than the guess: it knows its prior
  return options;
}

struct LearningResult {
  std::int64_t mapped = 0;  // frames
  bool completed = false;   // some of them at the end only
  double mean_squared_error = std::numeric_limits<double>::infinity();
};

// Maps frames with the best camera so far.
class LearningRun {
 public:
  LearningRun(const Sequence& sequence, const SystemOptions& options, RunHost& host)
      : sequence_(sequence), options_(options), host_(host) {}

  // Returns the result. `planned`: frames that are certain to be played in all. `complete`: frames that are
  // lost may find a place at the end.
  LearningResult Map(const FrameRange& frames, std::int64_t planned, AutoCamera& camera,
                     bool complete = true) {
    SystemOptions options = LearningOptions(options_, camera);
    options.mapping.completion.max_frames *= complete ? 1 : 0;
    System system(camera.camera, options, [](const MapSnapshotPtr&) {});
    FrameSource source(sequence_, frames);
    source.Mute();  // the run itself warns of the same frames
    FramesAhead ahead(source, system, false);
    while (const std::optional<Frame> frame = host_.Stopped() ? std::nullopt : ahead.Next()) {
      system.Process(*frame);
      host_.ShowProgress(++played_, planned,
                         fmt::format("estimating the focal length, now {:.1f} px",
                                     InFilePixels(camera.camera, sequence_).fx));
    }
    const RunResult result = system.Finish([this] { return host_.Stopped(); });
    if (!result.map.learnt_camera || host_.Stopped()) {
      return {};
    }
    camera.Adopt(*result.map.learnt_camera);
    return {result.tracked, result.counters.placed_at_end > 0, result.map.learnt_camera->mean_squared_error};
  }

  std::int64_t Played() const { return played_; }

 private:
  const Sequence& sequence_;
  const SystemOptions& options_;
  RunHost& host_;
  std::int64_t played_ = 0;
};

// Begins anew with a focal length, given in lengths of the image's longer side.
AutoCamera WithGuess(AutoCamera camera, double focal, std::string guessed_by) {
  camera.guess.fx = camera.guess.fy = focal * std::max(camera.guess.width, camera.guess.height);
  camera.guessed_by = std::move(guessed_by);
  camera.camera = camera.guess;
  return camera;
}

// Returns true if a lens that was estimated as a fisheye lens is one: it sees much, and is nearer to an
// equidistant lens, r = f theta, than to a perspective one, r = f tan(theta) = f (theta + theta^3 / 3 + ...),
// which a fisheye lens with a k1 of 1/3 imitates.
bool IsFisheye(const Camera& camera) {
  constexpr double kMinDiagonal = 1.75;  // rad, 100 degrees
  constexpr double kMaxRadial = 1.0 / 6.0;
  return std::hypot(camera.width, camera.height) / camera.fx > kMinDiagonal &&
         camera.distortion[0] < kMaxRadial;
}

// Maps the first frames with both lenses three times, for the first maps are made with a guess. Returns the
// likelier lens. A fisheye lens must be one each time, map as many frames in the end, and have the smaller
// errors in the mean of the logs: maps of one lens differ as much as those of two.
AutoCamera LikelierLens(LearningRun& run, const LearningFrames& frames, AutoCamera usual,
                        AutoCamera fisheye) {
  constexpr int kPasses = 3;
  constexpr double kMinMapped = 0.9;  // frames, of those that the usual lens maps
  LearningResult first;
  LearningResult second;
  double log_ratio = 0.0;  // sum over the passes, of the mean squared errors
  for (int pass = 0; pass < kPasses; ++pass) {
    first = run.Map(frames.first, run.Played() + 2 * frames.first.count, usual);
    second = run.Map(frames.first, run.Played() + frames.first.count, fisheye, first.completed);
    log_ratio += std::log(second.mean_squared_error / first.mean_squared_error);
    if (!IsFisheye(fisheye.camera)) {
      return usual;
    }
  }
  return second.mapped >= kMinMapped * first.mapped && log_ratio < 0.0 ? fisheye : usual;
}

// Maps the second frames again and again, until the camera settles or they were played often enough. Returns
// the mean squared error of the last map.
double MapUntilSettled(LearningRun& run, const LearningFrames& frames, const RunHost& host,
                       AutoCamera& camera) {
  const std::int64_t played = run.Played();
  double mean_squared_error = std::numeric_limits<double>::infinity();
  for (bool settled = false; !settled && !host.Stopped() && frames.Allow(run.Played() - played);) {
    const AutoCamera before = camera;
    mean_squared_error =
        run.Map(frames.second, run.Played() + frames.second.count, camera).mean_squared_error;
    settled = IsSettled(before, camera);
  }
  return mean_squared_error;
}

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
      fmt::format("camera: {}focal length {}, {}", camera.lens == LensModel::kFisheye ? "fisheye lens, " : "",
                  InWords(camera), IntervalText(camera.fx, deviation));
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
  constexpr double kPlayedFps = 10.0;       // of a slow film, in all
  constexpr std::int64_t kMinFrames = 50;   // of the second part, if there are as many
  constexpr std::int64_t kMaxFrames = 600;  // of the second part: the first minute
  constexpr std::int64_t kFirst = 50;       // of the first part, likewise
  constexpr std::int64_t kMaxPasses = 5;    // of the second part
  constexpr std::int64_t kShortSet = 200;   // frames that may be played in all, even of fewer images
  LearningFrames frames;
  frames.second = ThinnedRange(range, available, fps, kFps, kMinFrames);
  frames.second.count = std::min(frames.second.count, kMaxFrames);
  frames.first = frames.second;
  frames.first.count = std::min(frames.first.count, kFirst);
  const double seconds = static_cast<double>(available * range.stride) / fps;
  const auto in_time = static_cast<std::int64_t>(kPlayedFps * seconds);
  frames.most = std::min(std::max({available, in_time, kShortSet}), kMaxPasses * frames.second.count);
  return frames;
}

AutoCamera WithFisheyeLens(AutoCamera camera) {
  constexpr double kFocal = 0.35;  // of the longer side: 164 degrees; lenses have 0.27 to 0.5
  camera.guess.lens = LensModel::kFisheye;
  return WithGuess(std::move(camera), kFocal, "a fisheye lens of 164 degrees");
}

AutoCamera WithWideLens(AutoCamera camera) {
  constexpr double kFocal = 0.55;  // of the longer side: 85 degrees, as drones and action cameras have
  return WithGuess(std::move(camera), kFocal, "a wide field of view of 85 degrees");
}

bool IsSettled(const AutoCamera& before, const AutoCamera& after) {
  constexpr double kMaxChange = 0.5;  // deviations; as much again may still be missing
  const Camera& camera = before.camera;
  const Eigen::Vector2d center(camera.cx, camera.cy);
  for (const double x : {0.0, 0.5, 1.0}) {
    for (const double y : {0.0, 0.5, 1.0}) {
      const Eigen::Vector3d ray =
          camera.Unproject(camera.Undistort({x * (camera.width - 1), y * (camera.height - 1)}));
      const Eigen::Vector2d pixel = camera.ProjectDistorted(ray);
      const double change = (after.camera.ProjectDistorted(ray) - pixel).norm();
      if (change > kMaxChange * after.deviation * (pixel - center).norm() + 1e-9) {
        return false;
      }
    }
  }
  return true;
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
  const bool vague_guess = result.guess_deviation > kVagueGuess;
  AutoCamera wide = WithWideLens(result);
  if (vague_guess) {
    result = LikelierLens(run, frames, result, WithFisheyeLens(result));
  }
  const double error = MapUntilSettled(run, frames, host, result);
  if (vague_guess && result.IsVague() && MapUntilSettled(run, frames, host, wide) < error &&
      wide.deviation < result.deviation) {
    result = wide;
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
