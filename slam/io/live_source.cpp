#include "slam/io/live_source.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <thread>
#include <utility>

#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

constexpr int kMaxFailures = 3;  // missing images in a row after which the camera counts as gone

}  // namespace

FrameGrabber OpenCamera(int index, const Camera& camera) {
  const auto video = std::make_shared<cv::VideoCapture>();
  ThrowIf<InputError>(
      !video->open(index),
      "camera {}: cannot be opened, expected a camera that is plugged in, readable and not in use", index);
  video->set(cv::CAP_PROP_FRAME_WIDTH, camera.width);
  video->set(cv::CAP_PROP_FRAME_HEIGHT, camera.height);
  video->set(cv::CAP_PROP_FPS, camera.fps);
  return [video](cv::Mat& bgr) { return video->read(bgr); };
}

std::function<double()> LiveClock() {
  using Seconds = std::chrono::duration<double>;
  const auto steady_start = std::chrono::steady_clock::now();
  const double start = Seconds(std::chrono::system_clock::now().time_since_epoch()).count();
  return [=] { return start + Seconds(std::chrono::steady_clock::now() - steady_start).count(); };
}

struct LiveSource::Impl {
  Impl(FrameGrabber grabber_in, const Camera& camera_in, std::string name_in, const FrameRange& range_in,
       std::function<double()> now_in, std::function<bool()> stopped_in)
      : grabber(std::move(grabber_in)),
        camera(camera_in),
        name(std::move(name_in)),
        range(range_in),
        now(std::move(now_in)),
        stopped(std::move(stopped_in)) {
    cv::Mat first;
    ThrowIf<InputError>(!grabber(first), "{}: gives no image, expected a working camera", name);
    ThrowIf<InputError>(
        first.size() != cv::Size(camera.width, camera.height) || first.type() != CV_8UC3,
        "{}: gives images of {}x{} with {} channels, expected the calibration's {}x{} in colour", name,
        first.cols, first.rows, first.channels(), camera.width, camera.height);
    Publish(first);
    thread = std::jthread([this](const std::stop_token& stop) { Run(stop); });
  }

  // The grabber may reuse its buffer, so the frame gets a copy.
  void Publish(const cv::Mat& bgr) {
    const std::int64_t index = grabbed++;
    last_timestamp = std::max(now(), last_timestamp + kMinStep);
    if (index < range.start || (index - range.start) % range.stride != 0) {
      return;
    }
    Frame frame;
    frame.index = index;
    frame.timestamp = last_timestamp;
    frame.bgr = bgr.clone();
    cv::cvtColor(frame.bgr, frame.gray, cv::COLOR_BGR2GRAY);
    const std::lock_guard lock(mutex);
    dropped += newest.has_value() ? 1 : 0;
    newest = std::move(frame);
    changed.notify_all();
  }

  void Skip(int images) {
    grabbed += images;
    const std::lock_guard lock(mutex);
    skipped += images;
  }

  void Run(const std::stop_token& stop) {
    int failures = 0;
    while (!stop.stop_requested() && failures < kMaxFailures) {
      cv::Mat bgr;
      if (grabber(bgr) && bgr.size() == cv::Size(camera.width, camera.height) && bgr.type() == CV_8UC3) {
        Skip(std::exchange(failures, 0));  // not those at the end, where no image was there to skip
        Publish(bgr);
        continue;
      }
      ++failures;
    }
    if (failures == kMaxFailures) {
      spdlog::warn("{}: gives no more images after {}", name, grabbed);
    }
    const std::lock_guard lock(mutex);
    finished = true;
    changed.notify_all();
  }

  std::optional<Frame> Next() {
    std::unique_lock lock(mutex);
    if (given >= range.count) {
      return std::nullopt;
    }
    while (!changed.wait_for(lock, kPatience, [&] { return finished || newest; })) {
      if (stopped && stopped()) {
        return std::nullopt;
      }
    }
    given += newest ? 1 : 0;
    return std::exchange(newest, std::nullopt);
  }

  static constexpr std::chrono::milliseconds kPatience{100};  // between two checks of `stopped`
  static constexpr double kMinStep = 1e-6;  // seconds; timestamps rise even if the clock does not

  const FrameGrabber grabber;
  const Camera camera;
  const std::string name;
  const FrameRange range;
  const std::function<double()> now;
  const std::function<bool()> stopped;  // may be empty
  std::int64_t grabbed = 0;             // grabbing thread only
  double last_timestamp = 0.0;          // grabbing thread only
  std::int64_t given = 0;               // caller's thread only
  mutable std::mutex mutex;
  std::condition_variable changed;
  std::optional<Frame> newest;  // guarded by mutex
  bool finished = false;        // guarded by mutex
  int skipped = 0;              // guarded by mutex
  int dropped = 0;              // guarded by mutex
  std::jthread thread;          // last: joined before the rest goes
};

LiveSource::LiveSource(FrameGrabber grabber, const Camera& camera, std::string name, const FrameRange& range,
                       std::function<double()> now, std::function<bool()> stopped)
    : impl_(std::make_unique<Impl>(std::move(grabber), camera, std::move(name), range, std::move(now),
                                   std::move(stopped))) {}
LiveSource::~LiveSource() = default;
std::optional<Frame> LiveSource::Next() { return impl_->Next(); }

int LiveSource::Skipped() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->skipped;
}

int LiveSource::Dropped() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->dropped;
}

}  // namespace sqslam
