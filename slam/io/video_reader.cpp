#include "slam/io/video_reader.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>
#include <utility>

#include "slam/io/video_index.h"
#include "slam/util/throw_if.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libswscale/swscale.h>
}

namespace sqslam {
namespace {

struct FreeVideo {
  void operator()(AVCodecContext* context) const { avcodec_free_context(&context); }
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
  void operator()(SwsContext* context) const { sws_freeContext(context); }
};

template <typename Type>
using Owned = std::unique_ptr<Type, FreeVideo>;

constexpr const char* kError = "{}: cannot be decoded: {}; expected a video that FFmpeg can decode";

Owned<AVCodecContext> OpenDecoder(const std::filesystem::path& path, const AVStream& stream) {
  const AVCodec* const codec = avcodec_find_decoder(stream.codecpar->codec_id);
  ThrowIf<InputError>(codec == nullptr, kError, path.string(), "its codec is unknown");
  Owned<AVCodecContext> decoder(avcodec_alloc_context3(codec));
  decoder->thread_count = 0;  // one a core
  int result = avcodec_parameters_to_context(decoder.get(), stream.codecpar);
  decoder->pkt_timebase = stream.time_base;
  result = result < 0 ? result : avcodec_open2(decoder.get(), codec, nullptr);
  ThrowIf<InputError>(result < 0, kError, path.string(), FfmpegReason(result));
  return decoder;
}

// Returns the number of an enumerator that decoders read from the file: it may be none of the known ones.
template <typename Enum>
int EnumNumber(const Enum& value) {
  int number = 0;
  static_assert(sizeof(value) == sizeof(number));
  std::memcpy(&number, &value, sizeof(number));
  return number;
}

// Returns swscale's number of the matrix from YUV to RGB.
int MatrixOf(const AVFrame& frame) {
  switch (EnumNumber(frame.colorspace)) {
    case AVCOL_SPC_BT709:
      return SWS_CS_ITU709;
    case AVCOL_SPC_FCC:
      return SWS_CS_FCC;
    case AVCOL_SPC_SMPTE240M:
      return SWS_CS_SMPTE240M;
    case AVCOL_SPC_BT2020_NCL:
    case AVCOL_SPC_BT2020_CL:
      return SWS_CS_BT2020;
    case AVCOL_SPC_UNSPECIFIED:
    case AVCOL_SPC_RESERVED:
      return frame.width >= 1280 || frame.height > 576 ? SWS_CS_ITU709 : SWS_CS_ITU601;
    default:
      return SWS_CS_ITU601;
  }
}

bool IsFullRange(const AVFrame& frame) {
  const bool jpeg_format = frame.format == AV_PIX_FMT_YUVJ420P || frame.format == AV_PIX_FMT_YUVJ422P ||
                           frame.format == AV_PIX_FMT_YUVJ444P || frame.format == AV_PIX_FMT_YUVJ440P ||
                           frame.format == AV_PIX_FMT_YUVJ411P;
  return jpeg_format || EnumNumber(frame.color_range) == AVCOL_RANGE_JPEG;
}

// Returns swscale's brightness that makes up for its rounding. Its fast conversion of these formats rounds
// all terms down, which makes pictures 1.2 grey levels too dark on average; one level more leaves 0.1, at
// most 1.6.
int BrightnessFor(const AVFrame& frame, int width) {
  constexpr int kGreyLevel = 256;
  const bool fast = width == frame.width && frame.height % 2 == 0 &&
                    (frame.format == AV_PIX_FMT_YUV420P || frame.format == AV_PIX_FMT_YUV422P ||
                     frame.format == AV_PIX_FMT_YUVJ420P || frame.format == AV_PIX_FMT_YUVJ422P);
  return fast ? kGreyLevel : 0;
}

}  // namespace

struct VideoReader::Impl {
  Impl(const std::filesystem::path& path, std::vector<std::int64_t> frame_times)
      : times(std::move(frame_times)),
        video(OpenVideoStream(path, kError)),
        decoder(OpenDecoder(path, *video.stream)),
        packet(av_packet_alloc()),
        frame(av_frame_alloc()) {}

  // Sends the next packet of the stream to the decoder, or the end of the file.
  void Send() {
    while (!drained) {
      const int result = av_read_frame(video.format.get(), packet.get());
      if (result < 0) {
        drained = true;
        avcodec_send_packet(decoder.get(), nullptr);
        return;
      }
      const bool of_stream = packet->stream_index == video.stream->index;
      if (of_stream) {
        avcodec_send_packet(decoder.get(), packet.get());  // an error loses this packet's frame only
      }
      av_packet_unref(packet.get());
      if (of_stream) {
        return;
      }
    }
  }

  // Decodes the next frame that is in the index, and finds its number.
  void Decode() {
    ended = false;
    while (!ended) {
      const int result = avcodec_receive_frame(decoder.get(), frame.get());
      if (result >= 0 && Number()) {
        ++decoded;
        return;
      }
      ended = result == AVERROR_EOF || (result < 0 && drained);
      if (result < 0 && !ended) {
        Send();
      }
    }
  }

  // Finds the number of the decoded frame by its time, or by counting if there are no times. Returns false
  // for a frame that is not in the index.
  bool Number() {
    const std::int64_t time = frame->pts != AV_NOPTS_VALUE ? frame->pts : frame->best_effort_timestamp;
    ++number;
    if (times.empty() || time == AV_NOPTS_VALUE) {
      return true;
    }
    auto found =
        std::lower_bound(times.begin() + std::min(number, std::ssize(times)), times.end(), time - tolerance);
    const auto next = found == times.end() ? found : std::next(found);
    found = next != times.end() && *found < time && *next <= time ? next : found;
    const bool listed = found != times.end() && *found <= time + tolerance;
    number = listed ? found - times.begin() : number - 1;
    return listed;
  }

  cv::Mat Convert() {
    const int width = SquarePixels(*video.stream, {frame->width, frame->height}).width;
    // The scaler writes whole registers, past the end of the last row where the width is no multiple of
    // theirs.
    const int spare_rows = 1 + kRegisterBytes / (3 * width);
    const cv::Mat bgr = cv::Mat(frame->height + spare_rows, width, CV_8UC3).rowRange(0, frame->height);
    scaler.reset(sws_getCachedContext(scaler.release(), frame->width, frame->height,
                                      static_cast<AVPixelFormat>(frame->format), width, frame->height,
                                      AV_PIX_FMT_BGR24, kScaling, nullptr, nullptr, nullptr));
    if (!scaler) {
      return {};
    }
    constexpr int kOne = 1 << 16;
    sws_setColorspaceDetails(scaler.get(), sws_getCoefficients(MatrixOf(*frame)), IsFullRange(*frame) ? 1 : 0,
                             sws_getCoefficients(SWS_CS_DEFAULT), 1, BrightnessFor(*frame, width), kOne,
                             kOne);
    const std::array<std::uint8_t*, 4> pixels = {bgr.data};
    const std::array<int, 4> bytes = {static_cast<int>(bgr.step)};
    sws_scale(scaler.get(), frame->data, frame->linesize, 0, frame->height, pixels.data(), bytes.data());
    return bgr;
  }

  static constexpr int kRegisterBytes = 64;
  static constexpr int kScaling = SWS_BICUBIC;  // SWS_ACCURATE_RND takes seven times as long

  const std::vector<std::int64_t> times;
  // Tolerates a quarter of a frame between a decoded time and the index: some old codecs give inexact times.
  const std::int64_t tolerance = times.size() > 1 ? (times.back() - times.front()) / std::ssize(times) / 4
                                                  : 0;
  VideoStream video;
  Owned<AVCodecContext> decoder;
  Owned<AVPacket> packet;
  Owned<AVFrame> frame;  // decoded last
  Owned<SwsContext> scaler;
  std::int64_t number = -1;  // of that frame
  std::int64_t decoded = 0;
  bool drained = false;  // the file's packets are all sent
  bool ended = false;
};

VideoReader::VideoReader(const std::filesystem::path& path, std::vector<std::int64_t> times)
    : impl_(std::make_unique<Impl>(path, std::move(times))) {}
VideoReader::~VideoReader() = default;

std::optional<cv::Mat> VideoReader::Read(std::int64_t index) {
  while (impl_->number < index && !impl_->ended) {
    impl_->Decode();
  }
  if (impl_->ended || impl_->number != index) {
    return std::nullopt;
  }
  cv::Mat image = impl_->Convert();
  return image.empty() ? std::nullopt : std::optional(std::move(image));
}

bool VideoReader::Ended() const { return impl_->ended; }

std::int64_t VideoReader::Decoded() const { return impl_->decoded; }

}  // namespace sqslam
