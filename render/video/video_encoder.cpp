#include "render/video/video_encoder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <span>
#include <string>
#include <string_view>

#include "render/video/palette.h"
#include "slam/io/video_index.h"
#include "slam/util/throw_if.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/cpu.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

namespace sqslam {
namespace fs = std::filesystem;
namespace {

struct Free {
  void operator()(AVCodecContext* context) const { avcodec_free_context(&context); }
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
  void operator()(SwsContext* context) const { sws_freeContext(context); }
  void operator()(AVFormatContext* format) const {
    avio_closep(&format->pb);
    avformat_free_context(format);
  }
};
template <typename T>
using Owned = std::unique_ptr<T, Free>;

// Container and codecs of one kind of file.
struct VideoFormat {
  const char* muxer;
  std::array<const char*, 2> encoders;  // the first that this FFmpeg has
  AVPixelFormat pixels;
};

VideoFormat FormatOf(const fs::path& path) {
  const std::string extension = path.extension().string();
  return extension == ".gif"    ? VideoFormat{"gif", {"gif", nullptr}, AV_PIX_FMT_PAL8}
         : extension == ".webp" ? VideoFormat{"webp", {"libwebp_anim", nullptr}, AV_PIX_FMT_YUV420P}
                                : VideoFormat{"mp4", {"libx264", "mpeg4"}, AV_PIX_FMT_YUV420P};
}

// A file to write the packets of one video to.
class VideoFile {
 public:
  // Error messages show `name`.
  VideoFile(const fs::path& path, const fs::path& name) : name_(name.string()) {
    av_log_set_level(AV_LOG_FATAL);  // errors are thrown instead
    const std::string file = FfmpegName(path);
    AVFormatContext* format = nullptr;
    Check(avformat_alloc_output_context2(&format, nullptr, FormatOf(name).muxer, file.c_str()));
    format_.reset(format);
    Check(avio_open(&format->pb, file.c_str(), AVIO_FLAG_WRITE));
  }

  // `cover`: size of the picture for WriteCover(), which an .mp4 may have; empty: none.
  AVStream* AddStream(const AVCodecParameters* coding, AVRational time_base, cv::Size cover) {
    AVStream* stream = avformat_new_stream(format_.get(), nullptr);
    Check(stream == nullptr ? AVERROR(ENOMEM) : avcodec_parameters_copy(stream->codecpar, coding));
    stream->codecpar->codec_tag = 0;
    stream->codecpar->bit_rate = 0;  // pieces of a video know only their own
    stream->time_base = time_base;
    stream->avg_frame_rate = av_inv_q(time_base);
    if (!cover.empty()) {
      AddCoverStream(cover);
    }
    AVDictionary* options = nullptr;
    av_dict_set(&options, "movflags", "+faststart", 0);  // playable while loading
    av_dict_set(&options, "loop", "0", 0);               // .gif and .webp: for ever
    const int result = avformat_write_header(format_.get(), &options);
    av_dict_free(&options);
    Check(result);
    return stream;
  }

  void Write(AVPacket* packet) {
    Check(av_write_frame(format_.get(), packet));
    Check(format_->pb->error);
  }

  // Sets the picture that stands for the video in a list of files. `jpeg`: of the size announced.
  void WriteCover(std::span<const std::uint8_t> jpeg) {
    const Owned<AVPacket> packet(av_packet_alloc());
    Check(av_new_packet(packet.get(), static_cast<int>(jpeg.size())));
    std::ranges::copy(jpeg, packet->data);
    packet->stream_index = 1;
    packet->pts = packet->dts = 0;
    packet->flags |= AV_PKT_FLAG_KEY;
    Write(packet.get());
  }

  void Finish() {
    Check(av_write_trailer(format_.get()));
    Check(format_->pb->error);
    Check(avio_closep(&format_->pb));
  }

  bool WantsGlobalHeader() const { return (format_->oformat->flags & AVFMT_GLOBALHEADER) != 0; }

 private:
  void AddCoverStream(cv::Size size) {
    AVStream* cover = avformat_new_stream(format_.get(), nullptr);
    Check(cover == nullptr ? AVERROR(ENOMEM) : 0);
    cover->codecpar->codec_type = AVMEDIA_TYPE_VIDEO;
    cover->codecpar->codec_id = AV_CODEC_ID_MJPEG;
    cover->codecpar->width = size.width;
    cover->codecpar->height = size.height;
    cover->disposition = AV_DISPOSITION_ATTACHED_PIC;
  }

  void Check(int result) const {
    if (result < 0) {
      throw InputError("{}: the video cannot be written ({}), expected a writable folder with free space",
                       name_, FfmpegReason(result));
    }
  }

  std::string name_;
  Owned<AVFormatContext> format_;
};

}  // namespace

struct VideoEncoder::Impl {
  Impl(const fs::path& path, const fs::path& wanted_name, cv::Size wanted_size, double wanted_fps)
      : name(wanted_name.string()),
        format(FormatOf(wanted_name)),
        size(wanted_size),
        fps(wanted_fps),
        file(path, wanted_name) {
    Open();
    AVCodecParameters* coding = avcodec_parameters_alloc();
    avcodec_parameters_from_context(coding, codec.get());
    stream = file.AddStream(coding, codec->time_base, HasCover() ? size : cv::Size());
    avcodec_parameters_free(&coding);
    frame.reset(av_frame_alloc());
    frame->format = codec->pix_fmt;
    frame->width = size.width;
    frame->height = size.height;
    av_frame_get_buffer(frame.get(), 0);
    packet.reset(av_packet_alloc());
    if (codec->pix_fmt == AV_PIX_FMT_PAL8) {
      return;  // has a palette of its own in each frame
    }
    scaler.reset(sws_getContext(size.width, size.height, AV_PIX_FMT_BGR24, size.width, size.height,
                                codec->pix_fmt, SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INP, nullptr,
                                nullptr, nullptr));
    const int* bt601 = sws_getCoefficients(SWS_CS_ITU601);
    sws_setColorspaceDetails(scaler.get(), bt601, 1, bt601, 0, 0, 1 << 16, 1 << 16);
  }

  // Begins a segment with an encoder of its own.
  void Open() {
    for (const char* encoder : format.encoders) {
      const AVCodec* found = encoder != nullptr ? avcodec_find_encoder_by_name(encoder) : nullptr;
      if (found != nullptr && TryOpen(found)) {
        return;
      }
    }
    throw InputError("{}: this FFmpeg has no encoder for it, expected {}", name, format.encoders.front());
  }

  bool TryOpen(const AVCodec* found) {
    codec.reset(avcodec_alloc_context3(found));
    codec->width = size.width;
    codec->height = size.height;
    codec->pix_fmt = format.pixels;
    codec->framerate = av_d2q(fps, 100000);
    codec->time_base = av_inv_q(codec->framerate);
    codec->gop_size = SegmentFrames(fps);  // the first frame of a segment suffices
    codec->thread_count = 4;  // x264's stream depends on it, but must not depend on the machine's cores
    codec->color_range = AVCOL_RANGE_MPEG;
    codec->colorspace = AVCOL_SPC_SMPTE170M;  // the default of programs that read no tags (OpenCV)
    codec->color_primaries = AVCOL_PRI_BT709;
    codec->color_trc = AVCOL_TRC_BT709;
    codec->global_quality = 3 * FF_QP2LAMBDA;  // MPEG-4 only
    codec->flags |= found->id == AV_CODEC_ID_MPEG4 ? AV_CODEC_FLAG_QSCALE : 0;
    codec->flags |= file.WantsGlobalHeader() ? AV_CODEC_FLAG_GLOBAL_HEADER : 0;
    av_opt_set(codec->priv_data, "preset", "veryfast", 0);
    av_opt_set(codec->priv_data, "crf", "20", 0);
    av_opt_set(codec->priv_data, "quality", "80", 0);  // WebP only
    if ((av_get_cpu_flags() & AV_CPU_FLAG_AVX512) != 0) {
      // With AVX-512, "macroblock tree" of x264 0.164 reads memory that nobody has written.
      av_opt_set(codec->priv_data, "x264-params", "asm=avx2", 0);
    }
    return avcodec_open2(codec.get(), found, nullptr) == 0;
  }

  // Sends a frame (nullptr: end of video) and writes the packets that are ready.
  void Encode(AVFrame* next) {
    Check(avcodec_send_frame(codec.get(), next));
    for (;;) {
      const int result = avcodec_receive_packet(codec.get(), packet.get());
      if (result == AVERROR(EAGAIN) || result == AVERROR_EOF) {
        return;
      }
      Check(result);
      packet->duration = 1;
      av_packet_rescale_ts(packet.get(), codec->time_base, stream->time_base);
      packet->stream_index = stream->index;
      file.Write(packet.get());
      av_packet_unref(packet.get());
    }
  }

  bool HasCover() const { return std::string_view(format.muxer) == "mp4"; }

  void Fill(const cv::Mat& bgr) {
    if (codec->pix_fmt == AV_PIX_FMT_PAL8) {
      const PaletteImage image = ReduceColors(bgr);
      for (int y = 0; y < bgr.rows; ++y) {
        std::copy_n(image.index.ptr(y), bgr.cols, frame->data[0] + y * frame->linesize[0]);
      }
      std::ranges::copy(image.argb, reinterpret_cast<std::uint32_t*>(frame->data[1]));
      return;
    }
    const std::uint8_t* const rows[] = {bgr.data};
    const int stride[] = {static_cast<int>(bgr.step[0])};
    sws_scale(scaler.get(), rows, stride, 0, bgr.rows, frame->data, frame->linesize);
  }

  void Check(int result) const {
    if (result < 0) {
      throw std::runtime_error(fmt::format("{}: a frame cannot be encoded: {}", name, FfmpegReason(result)));
    }
  }

  std::string name;
  VideoFormat format;
  cv::Size size;
  double fps;
  VideoFile file;
  Owned<AVCodecContext> codec;
  AVStream* stream = nullptr;  // owned by `file`
  Owned<AVFrame> frame;
  Owned<AVPacket> packet;
  Owned<SwsContext> scaler;
  std::int64_t next_time = 0;
  cv::Mat last;  // frame added
};

int SegmentFrames(double fps) { return std::max(1, static_cast<int>(std::lround(2.0 * fps))); }

VideoEncoder::VideoEncoder(const fs::path& path, cv::Size size, double fps, const fs::path& name)
    : impl_(std::make_unique<Impl>(path, name.empty() ? path : name, size, fps)) {}
VideoEncoder::~VideoEncoder() = default;

void VideoEncoder::Add(const cv::Mat& bgr) {
  Impl& s = *impl_;
  if (bgr.type() != CV_8UC3 || bgr.size() != s.size) {
    throw std::invalid_argument("a frame of another size or type than the video's");
  }
  if (s.HasCover() && s.next_time > 0 && s.next_time % SegmentFrames(s.fps) == 0) {
    s.Encode(nullptr);
    s.Open();
  }
  s.Check(av_frame_make_writable(s.frame.get()));
  s.Fill(bgr);
  s.last = bgr;
  s.frame->pts = s.next_time++;
  s.Encode(s.frame.get());
}

void VideoEncoder::Finish() {
  Impl& s = *impl_;
  s.Encode(nullptr);
  if (s.HasCover() && !s.last.empty()) {
    std::vector<std::uint8_t> jpeg;
    cv::imencode(".jpg", s.last, jpeg, {cv::IMWRITE_JPEG_QUALITY, 90});
    s.file.WriteCover(jpeg);
  }
  s.file.Finish();
}

namespace {

// Returns the picture that stands for a video in a list of files; empty if it has none.
std::span<const std::uint8_t> CoverOf(const VideoStream& video) {
  for (unsigned i = 0; i < video.format->nb_streams; ++i) {
    const AVStream& stream = *video.format->streams[i];
    if ((stream.disposition & AV_DISPOSITION_ATTACHED_PIC) != 0) {
      return {stream.attached_pic.data, static_cast<std::size_t>(stream.attached_pic.size)};
    }
  }
  return {};
}

bool SameCoding(const AVCodecParameters& a, const AVCodecParameters& b) {
  return a.codec_id == b.codec_id && a.width == b.width && a.height == b.height && a.format == b.format &&
         a.extradata_size == b.extradata_size &&
         std::equal(a.extradata, a.extradata + a.extradata_size, b.extradata);
}

}  // namespace

int ConcatenateVideos(const std::vector<fs::path>& videos, const std::vector<int>& frames,
                      const fs::path& output, const std::function<bool(int done, int total)>& progress) {
  VideoFile file(output, output);
  constexpr const char* kReadError = "{}: cannot be read as a video ({})";
  const VideoStream first = OpenVideoStream(videos.front(), kReadError);
  const AVRational frame_time = av_inv_q(first.stream->avg_frame_rate);
  const bool has_cover = !CoverOf(first).empty();
  AVStream* const stream = file.AddStream(
      first.stream->codecpar, frame_time,
      has_cover ? cv::Size(first.stream->codecpar->width, first.stream->codecpar->height) : cv::Size());
  const Owned<AVPacket> packet(av_packet_alloc());
  const int total = std::accumulate(frames.begin(), frames.end(), 0);
  int done = 0;
  int before = 0;  // frames of the previous videos
  std::vector<std::uint8_t> last_cover;
  bool go_on = true;
  std::int64_t last_dts = std::numeric_limits<std::int64_t>::min();
  for (std::size_t i = 0; i < videos.size() && go_on; ++i) {
    const VideoStream source = OpenVideoStream(videos[i], kReadError);
    ThrowIf<InputError>(!SameCoding(*source.stream->codecpar, *first.stream->codecpar),
                        "{}: encoded in another way than {}, expected pieces made by one program",
                        videos[i].string(), videos.front().string());
    const std::int64_t offset = av_rescale_q(before, frame_time, stream->time_base);
    while (go_on && av_read_frame(source.format.get(), packet.get()) >= 0) {
      if (packet->stream_index == source.stream->index) {
        av_packet_rescale_ts(packet.get(), source.stream->time_base, stream->time_base);
        packet->pts += offset;
        // A piece of two frames is too short for reordering: its decoding times start later than those of
        // others.
        packet->dts = last_dts = std::max(packet->dts + offset, last_dts + 1);
        packet->pos = -1;
        packet->stream_index = stream->index;
        file.Write(packet.get());
        av_packet_unref(packet.get());
        ++done;
        go_on = !progress || progress(done, total);
      } else {
        av_packet_unref(packet.get());
      }
    }
    before += frames[i];
    const std::span<const std::uint8_t> cover = CoverOf(source);
    last_cover.assign(cover.begin(), cover.end());
    ThrowIf<InputError>(go_on && done != before, "{}: {} frames can be read, expected {}", videos[i].string(),
                        done - before + frames[i], frames[i]);
  }
  if (has_cover && !last_cover.empty()) {
    file.WriteCover(last_cover);
  }
  file.Finish();
  return done;
}

}  // namespace sqslam
