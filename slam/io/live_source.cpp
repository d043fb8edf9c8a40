#include "slam/io/live_source.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

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
    ThrowIf<InputError>(!grabber(first), "{}: delivers no image, expected a working camera", name);
    ThrowIf<InputError>(
        first.size() != cv::Size(camera.width, camera.height) || first.type() != CV_8UC3,
        "{}: delivers images of {}x{} with {} channels, expected the calibration's {}x{} in colour", name,
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
      spdlog::warn("{}: delivers no more images after {}", name, grabbed);
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

namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr std::array<std::string_view, 7> kSchemes = {"rtsp://",  "rtsps://", "rtmp://", "http://",
                                                      "https://", "udp://",   "tcp://"};

int Milliseconds(double seconds) { return static_cast<int>(std::lround(1000.0 * seconds)); }

}  // namespace

bool IsStreamAddress(const std::string& text) {
  return std::ranges::any_of(kSchemes, [&](std::string_view scheme) { return text.starts_with(scheme); });
}

std::string PublicAddress(const std::string& address) {
  const std::string shown = address.substr(0, address.find('?'));
  const std::size_t host = shown.find("://") + 3;
  std::size_t path = std::min(shown.find('/', host), shown.size());
  // A port is a number: anything else after a ':' is a password that contains a '/'.
  const std::size_t colon = shown.find(':', host);
  if (colon < path && shown.find('@', host) > path &&
      shown.find_first_not_of("0123456789", colon + 1) < path) {
    path = shown.size();
  }
  const std::size_t at = shown.rfind('@', path);
  return at == std::string::npos || at < host ? shown : shown.substr(0, host) + shown.substr(at + 1);
}

struct NetworkStream::Impl {
  Impl(std::string address_in, StreamOptions options_in)
      : address(std::move(address_in)), options(std::move(options_in)) {}

  bool Open() {
    const std::vector<int> limits = {cv::CAP_PROP_OPEN_TIMEOUT_MSEC, Milliseconds(options.open_seconds),
                                     cv::CAP_PROP_READ_TIMEOUT_MSEC, Milliseconds(options.silence_seconds)};
    if (!video.open(address, cv::CAP_FFMPEG, limits)) {
      return false;
    }
    fps = video.get(cv::CAP_PROP_FPS);
    fps = std::isfinite(fps) && fps > 0.0 && fps < 1000.0 ? fps : 0.0;
    frames = static_cast<std::int64_t>(video.get(cv::CAP_PROP_FRAME_COUNT));
    return true;
  }

  bool IsFilm() const { return frames > 0 && fps > 0.0; }
  bool Stopped() const { return options.stopped && options.stopped(); }

  void KeepItsRate() {
    if (given == 0) {
      start = Clock::now();
    }
    std::this_thread::sleep_until(
        start + std::chrono::duration_cast<Clock::duration>(Seconds(static_cast<double>(given) / fps)));
  }

  bool OpenAgain(cv::Mat& bgr) {
    const Clock::time_point lost = Clock::now();
    spdlog::warn("{}: the connection is lost, trying again for {:.0f} s", PublicAddress(address),
                 options.retry_seconds);
    while (!Stopped() && Seconds(Clock::now() - lost).count() < options.retry_seconds) {
      if (Open() && video.read(bgr)) {
        spdlog::warn("{}: connected again after {:.1f} s", PublicAddress(address),
                     Seconds(Clock::now() - lost).count());
        return true;
      }
      std::this_thread::sleep_for(Seconds(options.retry_interval));
    }
    return false;
  }

  bool Read(cv::Mat& bgr) {
    if (IsFilm()) {
      KeepItsRate();
    }
    bool read = video.read(bgr);
    if (!read && !IsFilm() && !ended) {
      read = OpenAgain(bgr);
    }
    ended = !read;
    given += read ? 1 : 0;
    return read;
  }

  const std::string address;
  const StreamOptions options;
  cv::VideoCapture video;
  double fps = 0.0;
  std::int64_t frames = 0;  // 0 or less: endless
  std::int64_t given = 0;
  bool ended = false;
  Clock::time_point start;
};

NetworkStream::NetworkStream(const std::string& address, StreamOptions options)
    : impl_(std::make_unique<Impl>(address, std::move(options))) {
  ThrowIf<InputError>(!impl_->Open() || ImageSize().empty(),
                      "{}: cannot be opened, expected the address of a camera or video that responds",
                      PublicAddress(address));
}

NetworkStream::~NetworkStream() = default;

cv::Size NetworkStream::ImageSize() const {
  return {static_cast<int>(impl_->video.get(cv::CAP_PROP_FRAME_WIDTH)),
          static_cast<int>(impl_->video.get(cv::CAP_PROP_FRAME_HEIGHT))};
}

double NetworkStream::Fps() const { return impl_->fps; }
bool NetworkStream::Read(cv::Mat& bgr) { return impl_->Read(bgr); }

}  // namespace sqslam
