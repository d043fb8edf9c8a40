#include "slam/io/frame_source.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <limits>
#include <map>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "slam/io/image_files.h"
#include "slam/io/image_header.h"
#include "slam/io/video_reader.h"
#include "slam/util/image_decoding.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

// A truncated file can decode to a half-grey image without any error, so look for the format's end marker.
bool IsCutOff(std::string_view text) {
  struct Format {
    std::string_view start;
    std::string_view end;
  };
  constexpr std::array<Format, 2> kFormats = {{{"\xFF\xD8", "\xFF\xD9"}, {"\x89PNG", "IEND"}}};
  constexpr std::size_t kMaxTrailingBytes = 4096;  // some writers append bytes
  return std::ranges::any_of(kFormats, [&](const Format& format) {
    return text.starts_with(format.start) &&
           text.substr(text.size() - std::min(kMaxTrailingBytes, text.size())).find(format.end) ==
               std::string_view::npos;
  });
}

ShownImage DecodeFile(const std::filesystem::path& path, cv::Size frame,
                      const std::optional<ValueRange>& range) {
  const ImageFile file = ReadImageFile(path);
  if (!file.problem.empty() || IsCutOff(file.bytes)) {
    return {{{}, file.problem.empty() ? "is cut off" : file.problem}};
  }
  return DecodeForFrame(file.bytes, frame, cv::IMREAD_COLOR, range);
}

// Frames that were skipped for one kind of problem.
struct SkippedFrames {
  int count = 0;
  std::string first;  // the first of them, with its problem
};

}  // namespace

FrameRange ThinnedRange(const FrameRange& range, std::int64_t available, double fps, double rate,
                        std::int64_t min_frames) {
  const std::int64_t step =
      std::clamp<std::int64_t>(std::lround(fps / (rate * static_cast<double>(range.stride))), 1,
                               std::max<std::int64_t>(1, available / min_frames));
  return {range.start, (available + step - 1) / step, range.stride * step};
}

FrameRange ParseFrameRange(const std::string& frames, std::optional<std::int64_t> start,
                           std::int64_t stride) {
  const auto number = [&](const std::string& text, std::int64_t least) {
    const auto value = ParseNumber<std::int64_t>(text);
    ThrowIf<UsageError>(
        !value || *value < least,
        "--frames {}: expected N (the first N frames) or A:B, such as 0:30 (without frame 30)", frames);
    return *value;
  };
  FrameRange range{start.value_or(0), std::numeric_limits<std::int64_t>::max(), stride};
  const std::size_t colon = frames.find(':');
  if (frames.empty()) {
    return range;
  }
  if (colon == std::string::npos) {
    range.count = number(frames, 1);
    return range;
  }
  if (colon > 0) {
    if (start) {
      throw UsageError("--frames {} and --start {}: expected one start", frames, *start);
    }
    range.start = number(frames.substr(0, colon), 0);
  }
  if (colon + 1 < frames.size()) {
    const std::int64_t end = number(frames.substr(colon + 1), 1);
    ThrowIf<UsageError>(end <= range.start,
                        "--frames {}: contains no frame, expected B above {} (B is excluded)", frames,
                        range.start);
    range.count = (end - range.start + stride - 1) / stride;
  }
  return range;
}

std::int64_t FrameRange::SizeIn(const Sequence& sequence) const {
  const auto total = static_cast<std::int64_t>(sequence.frames.size());
  return start >= total ? 0 : std::min(count, (total - start + stride - 1) / stride);
}

void FrameRange::CheckHasFrames(const Sequence& sequence) const {
  ThrowIf<UsageError>(SizeIn(sequence) <= 0,
                      "no frame from {} on, expected a part of the sequence's {} frames", start,
                      sequence.frames.size());
}

struct FrameSource::Impl {
  Impl(const Sequence& sequence_in, const FrameRange& range_in, int decoded_ahead)
      : sequence(sequence_in),
        range(range_in),
        capacity(static_cast<std::size_t>(std::max(1, decoded_ahead))) {
    if (!sequence.video_path.empty()) {
      try {
        video = std::make_unique<VideoReader>(sequence.video_path, sequence.video_times);
      } catch (
          const InputError& error) {  // removed or changed since it was listed: ends before its first frame
        spdlog::warn(error.what());
      }
    }
    thread = std::jthread([this](const std::stop_token& stop) { Run(stop); });
  }

  bool VideoEnded() const { return !sequence.video_path.empty() && (!video || video->Ended()); }

  ShownImage DecodeVideo(std::int64_t index) {
    const std::optional<cv::Mat> read = video ? video->Read(index) : std::nullopt;
    if (!read) {
      return {{{}, "cannot be decoded"}};
    }
    const cv::Mat pixels = Turned(*read, sequence.quarter_turns);
    return {{pixels}, pixels.size()};
  }

  std::optional<Frame> Decode(std::int64_t index) {
    const SequenceFrame& listed = sequence.frames[static_cast<std::size_t>(index)];
    const cv::Size size(sequence.camera.width, sequence.camera.height);
    ShownImage image = sequence.video_path.empty() ? DecodeFile(listed.image_path, size, sequence.value_range)
                                                   : DecodeVideo(index);
    if (VideoEnded()) {
      return std::nullopt;
    }
    auto& [decoded, shown, turns] = image;
    const cv::Size expected = FileSize(sequence);
    std::string kind = decoded.problem;
    if (decoded.problem.empty() && !sequence.any_image_size && Turned(shown, turns) != expected) {
      kind = "has another size";
      decoded.problem = fmt::format("is {}x{}, expected the camera's {}x{}", shown.width, shown.height,
                                    expected.width, expected.height);
    }
    if (!decoded.problem.empty()) {
      ++skipped;
      const std::filesystem::path& file =
          sequence.video_path.empty() ? listed.image_path : sequence.video_path;
      SkippedFrames& alike = problems[kind];
      if (alike.count++ == 0) {
        alike.first = fmt::format("frame {} skipped: {} {}", index, file.string(), decoded.problem);
      }
      return std::nullopt;
    }
    Frame frame;
    frame.index = index;
    frame.timestamp = listed.timestamp;
    frame.image_path = listed.image_path.string();
    frame.quarter_turns = turns;
    frame.bgr = Resized(Turned(decoded.pixels, turns), size);
    cv::cvtColor(frame.bgr, frame.gray, cv::COLOR_BGR2GRAY);
    frame.detections = listed.detections;
    frame.ignored = Ignored(frame, listed.mask_path, shown);
    if (!sequence.fixed_regions.empty()) {
      frame.ignored =
          frame.ignored.empty() ? sequence.fixed_regions : cv::Mat(frame.ignored | sequence.fixed_regions);
    }
    return frame;
  }

  // Returns the mask in the size of the frame, with 255 where it is black. `image`: size of the shown image,
  // which a mask has, or that of the turned one, if it is the mask of all images.
  cv::Mat Ignored(const Frame& frame, const std::filesystem::path& file, cv::Size image) const {
    if (file.empty()) {
      return {};
    }
    cv::Mat mask = ReadImage(file, cv::IMREAD_GRAYSCALE);
    if (mask.size() == image) {
      mask = Turned(mask, frame.quarter_turns);
    } else if (mask.size() != Turned(image, frame.quarter_turns)) {
      Warn("frame {} has no mask: {} {}", frame.index, file.string(),
           mask.empty() ? "cannot be read"
                        : fmt::format("is {}x{}, expected the image's {}x{}", mask.cols, mask.rows,
                                      image.width, image.height));
      return {};
    }
    cv::Mat ignored;
    cv::resize(mask == 0, ignored, frame.bgr.size(), 0.0, 0.0, cv::INTER_NEAREST);
    return ignored;
  }

  template <typename... Args>
  void Warn(fmt::format_string<Args...> format, Args&&... args) const {
    if (!muted) {
      spdlog::warn(format, std::forward<Args>(args)...);
    }
  }

  void Run(const std::stop_token& stop) {
    const std::int64_t size = range.SizeIn(sequence);
    for (std::int64_t i = 0; i < size && !stop.stop_requested(); ++i) {
      if (std::optional<Frame> frame = Decode(range.start + i * range.stride)) {
        std::unique_lock lock(mutex);
        if (!changed.wait(lock, stop, [&] { return queue.size() < capacity; })) {
          break;
        }
        queue.push_back(std::move(*frame));
        changed.notify_all();
      }
      if (VideoEnded()) {
        Warn("{}: ends after {} of its {} frames; it may be damaged or cut off", sequence.video_path.string(),
             video ? video->Decoded() : 0, sequence.frames.size());
        skipped += static_cast<int>(size - i);
        break;
      }
    }
    for (const auto& [kind, frames] : problems) {
      Warn("{}{}", frames.first, frames.count > 1 ? fmt::format(" ({} such frames)", frames.count) : "");
    }
    const std::lock_guard lock(mutex);
    finished = true;
    changed.notify_all();
  }

  std::optional<Frame> Next() {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return finished || !queue.empty(); });
    if (queue.empty()) {
      return std::nullopt;
    }
    Frame frame = std::move(queue.front());
    queue.pop_front();
    changed.notify_all();
    return frame;
  }

  const Sequence sequence;  // a copy: the source may outlive the caller's
  const FrameRange range;
  const std::size_t capacity;
  std::unique_ptr<VideoReader> video;             // decoding thread only; null for image files
  std::map<std::string, SkippedFrames> problems;  // decoding thread only; by kind
  std::atomic<int> skipped = 0;
  std::atomic<bool> muted = false;
  std::mutex mutex;
  std::condition_variable_any changed;
  std::deque<Frame> queue;  // guarded by mutex
  bool finished = false;    // guarded by mutex
  std::jthread thread;      // last: joined before the rest goes
};

FrameSource::FrameSource(const Sequence& sequence, const FrameRange& range, int decoded_ahead)
    : impl_(std::make_unique<Impl>(sequence, range, decoded_ahead)) {}
FrameSource::~FrameSource() = default;
std::optional<Frame> FrameSource::Next() { return impl_->Next(); }
int FrameSource::Skipped() const { return impl_->skipped; }
void FrameSource::Mute() { impl_->muted = true; }

}  // namespace sqslam
