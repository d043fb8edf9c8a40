#include "slam/io/video_index.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include "slam/util/throw_if.h"

extern "C" {
#include <libavformat/avformat.h>
#include <libavutil/display.h>
}

namespace sqslam {
namespace {

constexpr double kMinStep = 1e-3;  // seconds; containers round times, and two frames must not share one

int QuarterTurnsOf(const AVStream& stream) {
  const std::uint8_t* matrix = av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr);
  if (matrix == nullptr) {
    return 0;
  }
  const double counter_clockwise = av_display_rotation_get(reinterpret_cast<const std::int32_t*>(matrix));
  if (!std::isfinite(counter_clockwise)) {
    return 0;
  }
  return ((static_cast<int>(std::lround(-counter_clockwise / 90.0)) % 4) + 4) % 4;
}

// Presentation times of packets in the stream's units; AV_NOPTS_VALUE if the container has none.
struct Packets {
  std::vector<std::int64_t> times;
  std::size_t without_time = 0;
  bool are_shown_times = true;  // of the pictures, not of decoding
  std::size_t read = 0;         // including packets without a picture to show
};

Packets ReadPackets(AVFormatContext& format, const AVStream& stream) {
  const auto drop = [](AVPacket* used) { av_packet_free(&used); };
  const std::unique_ptr<AVPacket, decltype(drop)> packet(av_packet_alloc(), drop);
  Packets packets;
  std::optional<std::int64_t> first_key;  // time of the first picture that needs no other
  bool last_corrupt = false;              // a truncated packet contains half a picture
  for (; av_read_frame(&format, packet.get()) >= 0; av_packet_unref(packet.get())) {
    if (packet->stream_index != stream.index) {
      continue;
    }
    const std::int64_t time = packet->pts != AV_NOPTS_VALUE ? packet->pts : packet->dts;
    ++packets.read;
    if (!first_key && (packet->flags & AV_PKT_FLAG_KEY) != 0) {
      first_key = time;
      packets.times.clear();
    }
    if ((packet->flags & AV_PKT_FLAG_DISCARD) == 0) {
      last_corrupt = (packet->flags & AV_PKT_FLAG_CORRUPT) != 0;
      packets.are_shown_times = packets.are_shown_times && packet->pts != AV_NOPTS_VALUE;
      packets.times.push_back(time);
    }
  }
  if (last_corrupt) {
    packets.times.pop_back();
    --packets.read;
  }
  packets.without_time = static_cast<std::size_t>(std::ranges::count(packets.times, AV_NOPTS_VALUE));
  if (packets.without_time == 0 && first_key) {
    // Pictures that are shown before it refer to pictures that were cut off.
    std::erase_if(packets.times, [&](std::int64_t time) { return time < *first_key; });
  }
  std::ranges::sort(packets.times);
  return packets;
}

std::vector<double> Timestamps(const Packets& packets, double unit, double fps) {
  std::vector<double> timestamps;
  for (std::size_t i = 0; i < packets.times.size(); ++i) {
    const double time = packets.without_time > 0
                            ? static_cast<double>(i) / fps
                            : unit * static_cast<double>(packets.times[i] - packets.times.front());
    timestamps.push_back(i == 0 ? time : std::max(time, timestamps.back() + kMinStep));
  }
  return timestamps;
}

}  // namespace

namespace {

// Returns the streams of moving pictures: no covers and no thumbnails.
std::vector<AVStream*> FilmStreams(const AVFormatContext& format) {
  std::vector<AVStream*> streams;
  for (unsigned int i = 0; i < format.nb_streams; ++i) {
    AVStream* const stream = format.streams[i];
    const bool still = (stream->disposition & (AV_DISPOSITION_ATTACHED_PIC | AV_DISPOSITION_TIMED_THUMBNAILS |
                                               AV_DISPOSITION_STILL_IMAGE)) != 0;
    if (stream->codecpar->codec_type == AVMEDIA_TYPE_VIDEO && !still) {
      streams.push_back(stream);
    }
  }
  return streams;
}

}  // namespace

std::string FfmpegReason(int error) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(error, text.data(), text.size());
  return text.data();
}

std::string FfmpegName(const std::filesystem::path& path) { return std::filesystem::absolute(path).string(); }

VideoStream OpenVideoStream(const std::filesystem::path& path, const char* message) {
  const auto check = [&](int result) {
    if (result < 0) {
      throw InputError(fmt::runtime(message), path.string(), FfmpegReason(result));
    }
    return result;
  };
  AVFormatContext* opened = nullptr;
  check(avformat_open_input(&opened, FfmpegName(path).c_str(), nullptr, nullptr));
  VideoStream video{{opened, [](AVFormatContext* format) { avformat_close_input(&format); }}, nullptr};
  check(avformat_find_stream_info(opened, nullptr));
  const std::vector<AVStream*> streams = FilmStreams(*opened);
  check(streams.empty() ? AVERROR_STREAM_NOT_FOUND : 0);
  const auto rank = [](const AVStream* stream) {
    const AVCodecParameters& picture = *stream->codecpar;
    return std::pair((stream->disposition & AV_DISPOSITION_DEFAULT) != 0,
                     std::int64_t{picture.width} * picture.height);
  };
  video.stream = *std::ranges::max_element(streams, {}, rank);
  video.others = static_cast<int>(streams.size()) - 1;
  return video;
}

cv::Size SquarePixels(const AVStream& stream, cv::Size picture) {
  const AVRational container = stream.sample_aspect_ratio;
  const AVRational ratio = container.num > 0 ? container : stream.codecpar->sample_aspect_ratio;
  if (ratio.num <= 0 || ratio.den <= 0) {
    return picture;
  }
  constexpr double kMaxRatio = 8.0;  // anything beyond is a mistake
  const double wide = std::clamp(av_q2d(ratio), 1.0 / kMaxRatio, kMaxRatio);
  return {static_cast<int>(std::lround(wide * picture.width)), picture.height};
}

VideoIndex IndexVideo(const std::filesystem::path& path) {
  av_log_set_level(AV_LOG_QUIET);  // errors are thrown
  const VideoStream opened =
      OpenVideoStream(path,
                      "{}: cannot be read as a video (damaged, cut off, or not a video): {}; "
                      "expected a video file or a sequence folder");
  const AVStream& stream = *opened.stream;
  VideoIndex index;
  index.stored = {stream.codecpar->width, stream.codecpar->height};
  index.width = SquarePixels(stream, index.stored).width;
  index.height = index.stored.height;
  index.quarter_turns = QuarterTurnsOf(stream);
  const AVRational rate = stream.avg_frame_rate.num > 0 ? stream.avg_frame_rate : stream.r_frame_rate;
  index.fps = rate.num > 0 && rate.den > 0 ? av_q2d(rate) : 30.0;
  const auto announced = static_cast<std::size_t>(std::max<std::int64_t>(0, stream.nb_frames));
  const Packets packets = ReadPackets(*opened.format, stream);
  index.timestamps = Timestamps(packets, av_q2d(stream.time_base), index.fps);
  if (packets.without_time == 0 && packets.are_shown_times) {
    index.times = packets.times;
  }
  const std::size_t count = index.timestamps.size();
  ThrowIf<InputError>(count == 0 || index.width <= 0 || index.height <= 0,
                      "{}: cannot be read as a video (damaged, cut off, or not a video): no frame; "
                      "expected a video file or a sequence folder",
                      path.string());
  if (count > 1) {
    index.fps = std::round(1e4 * static_cast<double>(count - 1) / index.timestamps.back()) / 1e4;
  }
  if (opened.others > 0) {
    spdlog::info("{}: has {} streams of video, of which number {} of {}x{} is taken", path.string(),
                 opened.others + 1, stream.index, index.stored.width, index.stored.height);
  }
  if (packets.read < announced) {
    spdlog::warn("{}: ends after {} of its {} frames; it may be damaged or cut off", path.string(), count,
                 announced);
  }
  return index;
}

}  // namespace sqslam
