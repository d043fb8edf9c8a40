#include "slam/io/network_stream.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <opencv2/videoio.hpp>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "slam/util/throw_if.h"

namespace sqslam {
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
