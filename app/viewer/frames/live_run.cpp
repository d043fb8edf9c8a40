#include "app/viewer/frames/live_run.h"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "app/report/report.h"
#include "app/terminal/terminal.h"
#include "slam/util/throw_if.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
namespace {

constexpr std::size_t kMaxCurveValues = 2000;  // about the columns of a screen

std::string StateName(TrackingState state) {
  switch (state) {
    case TrackingState::kTracking:
      return "tracking";
    case TrackingState::kLost:
      return "tracking is lost";
    case TrackingState::kNotInitialized:
      break;
  }
  return "waiting for the camera to move sideways";
}

}  // namespace

struct LiveRun::Impl : RunHost {
  Impl(const RunRequest& wanted, const app::RunPictures& wanted_pictures)
      : request(wanted), pictures(wanted_pictures) {}

  void Tell(auto&& change) {
    const std::lock_guard lock(mutex);
    change();
  }

  bool Ended() const {
    const std::lock_guard lock(mutex);
    return ended;
  }

  bool Stopped() const override { return Ended() || interrupt->Interrupted(); }

  bool AdmitFrame() override {
    std::unique_lock lock(mutex);
    if (status.max_rate > 0.0) {
      const auto due = last_frame + std::chrono::duration_cast<Clock::duration>(
                                        std::chrono::duration<double>(1.0 / status.max_rate));
      changed.wait_until(lock, due, [&] { return ended; });
    }
    while (!ended && !interrupt->Interrupted() && status.paused && steps == 0) {
      changed.wait_for(lock, std::chrono::milliseconds(100));  // signal handlers cannot notify
    }
    steps = std::max(0, steps - 1);
    last_frame = Clock::now();
    return !ended && !interrupt->Interrupted();
  }

  void ShowProgress(std::int64_t, std::int64_t total, const std::string&) override {
    Tell([&] { status.total = total; });
  }

  void Tracked(const Frame& frame, TrackingState state, const System& system) override {
    FrameView view = system.Newest();
    auto shown = std::make_shared<ShownFrame>();
    shown->frame_index = frame.index;
    shown->timestamp = frame.timestamp;
    shown->image = frame.bgr;
    for (const Detection& detection : frame.detections) {
      shown->detections.push_back({detection, -1});
    }
    shown->features = std::move(view.features);
    Tell([&] {
      pose = view.T_map_camera;
      news.frame = std::move(shown);
      tracks |= state == TrackingState::kTracking;  // no gap before the map begins
      news.moments.push_back({frame.index, frame.timestamp, 0, !tracks || state == TrackingState::kTracking});
      status.state = StateName(state);
      ++status.frames;
    });
  }

  void Mapped(const MapSnapshotPtr& map) override {
    Tell([&] {
      news.map = map;
      newest = map;
      series.Add(*map);
      series.Thin(kMaxCurveValues);
    });
  }

  // Drawn by the window's thread, which has OpenGL; skipped if the window goes away.
  void Draw(const FinishedRun& run, StageTimes& times) override {
    if (!pictures.draw) {
      return;
    }
    std::unique_lock lock(mutex);
    drawing = [&run, &times] {
      app::DrawRun(run.output, *run.result.map.snapshot, times, RenderBackend::kCurrent);
    };
    changed.wait(lock, [&] { return !drawing || abandoned; });
    drawing = nullptr;
    if (draw_failure) {
      std::rethrow_exception(std::exchange(draw_failure, nullptr));
    }
  }

  // Filmed by `sqslam`, which needs no display: OpenGL here belongs to the window's thread.
  void Film(const FinishedRun& run) override {
    const fs::path& video = pictures.video;
    if (video.empty() || run.interrupted) {
      return;
    }
    Tell([&] { status.state = "making the video"; });
    const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / "sqslam";
    const fs::path log = video.string() + ".log";
    const app::ChildResult made = app::RunChild(
        {"render", run.output.string(), "--growth", "--output", video.string(), "--quiet"}, log,
        [this] { return Ended(); }, program);
    std::error_code ignored;
    fs::remove(log, ignored);
    ThrowIf<InputError>(made.exit_code != 0 && !made.stopped, "{}: no video: {}", video.string(),
                        made.message);
    filmed = made.exit_code == 0;
  }

  void Report(const FinishedRun& run) override {
    if (pictures.draw) {
      app::WriteReport({run.output, "", run.sequence, filmed ? pictures.video : fs::path(), &run});
    }
  }

  void Work() {
    std::string error;
    fs::path result;
    const auto run_pipeline = [&] {
      interrupt.emplace();
      const FinishedRun run = RunPipeline(request, *this);
      result = fs::exists(run.output / "map.sqmap") ? run.output : fs::path();
      return run.interrupted && !Ended() ? 130 : 0;  // 130 after Ctrl-C, not if the window ended it
    };
    const int exit_code = app::ExitCodeOf(run_pipeline, [&](const std::string& message) { error = message; });
    interrupt.reset();
    Tell([&] {
      news.result = result;
      news.error = error;
      news.exit_code = exit_code;
      news.finished = true;
    });
  }

  RunRequest request;
  app::RunPictures pictures;
  std::optional<app::InterruptGuard> interrupt;  // during the run
  mutable std::mutex mutex;                      // guards the members below
  std::condition_variable changed;
  News news;
  RunStatus& status = news.status;
  MapSnapshotPtr newest;
  std::optional<Rigid3d> pose;  // of the newest frame
  RunSeries series;
  bool tracks = false;  // has tracked once
  bool filmed = false;  // the video is made
  bool ended = false;
  bool abandoned = false;
  int steps = 0;
  Clock::time_point last_frame = Clock::now();
  std::function<void()> drawing;
  std::exception_ptr draw_failure;
  std::thread thread;
};

LiveRun::LiveRun(const RunRequest& request, const app::RunPictures& pictures)
    : impl_(std::make_unique<Impl>(request, pictures)) {}

LiveRun::~LiveRun() {
  impl_->Tell([&] { impl_->ended = impl_->abandoned = true; });
  impl_->changed.notify_all();
  if (impl_->thread.joinable()) {
    impl_->thread.join();
  }
}

void LiveRun::Start() {
  impl_->thread = std::thread([this] { impl_->Work(); });
}

void LiveRun::Control(const RunControl& control) {
  using Command = RunControl::Command;
  impl_->Tell([&] {
    RunStatus& status = impl_->status;
    switch (control.command) {
      case Command::kStep:
        ++impl_->steps;
        [[fallthrough]];
      case Command::kPause:
        status.paused = true;
        break;
      case Command::kContinue:
        status.paused = false;
        break;
      case Command::kEnd:
        impl_->ended = true;
        break;
      case Command::kRate:
        status.max_rate = control.max_rate;
        break;
    }
  });
  impl_->changed.notify_all();
}

LiveRun::News LiveRun::Poll() {
  const std::lock_guard lock(impl_->mutex);
  Impl& s = *impl_;
  News now = s.news;
  RunStatus& status = now.status;
  status.ending = s.ended || (status.total > 0 && status.frames >= status.total);
  if (now.frame && s.newest) {  // the newest map, seen from the newest frame
    auto map = std::make_shared<MapSnapshot>(*s.newest);
    map->T_map_camera = s.pose;
    auto frame = std::make_shared<ShownFrame>(*now.frame);
    frame->map = std::move(map);
    now.frame = std::move(frame);
  }
  if (now.map) {
    now.series = s.series;
  }
  s.news.map = nullptr;
  s.news.frame = nullptr;
  s.news.moments.clear();
  return now;
}

void LiveRun::DrawPending() {
  std::function<void()> draw;
  impl_->Tell([&] { draw = impl_->drawing; });
  if (!draw) {
    return;
  }
  std::exception_ptr failure;
  try {
    draw();  // the run waits until this is done
  } catch (...) {
    failure = std::current_exception();
  }
  impl_->Tell([&] {
    impl_->drawing = nullptr;
    impl_->draw_failure = failure;
  });
  impl_->changed.notify_all();
}

}  // namespace sqslam::viewer
