#include "slam/io/video_index.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
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
  std::size_t read = 0;  // including packets without a picture to show
};

Packets ReadPackets(AVFormatContext& format, const AVStream& stream) {
  const auto drop = [](AVPacket* used) { av_packet_free(&used); };
  const std::unique_ptr<AVPacket, decltype(drop)> packet(av_packet_alloc(), drop);
  Packets packets;
  bool last_corrupt = false;  // a truncated packet contains half a picture
  while (av_read_frame(&format, packet.get()) >= 0) {
    packets.read += packet->stream_index == stream.index ? 1 : 0;
    if (packet->stream_index == stream.index && (packet->flags & AV_PKT_FLAG_DISCARD) == 0) {
      last_corrupt = (packet->flags & AV_PKT_FLAG_CORRUPT) != 0;
      const std::int64_t time = packet->pts != AV_NOPTS_VALUE ? packet->pts : packet->dts;
      packets.without_time += time == AV_NOPTS_VALUE ? 1 : 0;
      packets.times.push_back(time);
    }
    av_packet_unref(packet.get());
  }
  if (last_corrupt) {
    packets.without_time -= packets.times.back() == AV_NOPTS_VALUE ? 1 : 0;
    packets.times.pop_back();
    --packets.read;
  }
  return packets;
}

std::vector<double> Timestamps(Packets packets, double unit, double fps) {
  std::vector<double> timestamps;
  std::ranges::sort(packets.times);
  for (std::size_t i = 0; i < packets.times.size(); ++i) {
    const double time = packets.without_time > 0
                            ? static_cast<double>(i) / fps
                            : unit * static_cast<double>(packets.times[i] - packets.times.front());
    timestamps.push_back(i == 0 ? time : std::max(time, timestamps.back() + kMinStep));
  }
  return timestamps;
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
  video.stream = opened->streams[check(av_find_best_stream(opened, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0))];
  return video;
}

VideoIndex IndexVideo(const std::filesystem::path& path) {
  av_log_set_level(AV_LOG_QUIET);  // errors are thrown
  const VideoStream opened =
      OpenVideoStream(path,
                      "{}: cannot be read as a video (damaged, cut off, or not a video): {}; "
                      "expected a video file or a sequence folder");
  const AVStream& stream = *opened.stream;
  VideoIndex index;
  index.width = stream.codecpar->width;
  index.height = stream.codecpar->height;
  index.quarter_turns = QuarterTurnsOf(stream);
  const AVRational rate = stream.avg_frame_rate.num > 0 ? stream.avg_frame_rate : stream.r_frame_rate;
  index.fps = rate.num > 0 && rate.den > 0 ? av_q2d(rate) : 30.0;
  const auto announced = static_cast<std::size_t>(std::max<std::int64_t>(0, stream.nb_frames));
  const Packets packets = ReadPackets(*opened.format, stream);
  index.timestamps = Timestamps(packets, av_q2d(stream.time_base), index.fps);
  const std::size_t count = index.timestamps.size();
  ThrowIf<InputError>(count == 0 || index.width <= 0 || index.height <= 0,
                      "{}: cannot be read as a video (damaged, cut off, or not a video): no frame; "
                      "expected a video file or a sequence folder",
                      path.string());
  if (count > 1) {
    index.fps = std::round(1e4 * static_cast<double>(count - 1) / index.timestamps.back()) / 1e4;
  }
  if (packets.read < announced) {
    spdlog::warn("{}: ends after {} of its {} frames; it may be damaged or cut off", path.string(), count,
                 announced);
  }
  return index;
}

}  // namespace sqslam
