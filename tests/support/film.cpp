#include "tests/support/film.h"

#include <cmath>
#include <memory>
#include <stdexcept>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

namespace sqslam::testing {
namespace {

constexpr AVRational kTick = {1, 90000};

void Check(bool fine) {
  if (!fine) {
    throw std::runtime_error("the test's film cannot be written");
  }
}

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

class Film {
 public:
  Film(const std::filesystem::path& path, cv::Size size, const FilmOptions& options) {
    AVFormatContext* format = nullptr;
    Check(avformat_alloc_output_context2(&format, nullptr, "mp4", path.c_str()) >= 0);
    format_.reset(format);
    const AVCodec* codec = avcodec_find_encoder_by_name("libx264");
    codec = codec != nullptr ? codec : avcodec_find_encoder(AV_CODEC_ID_MPEG4);
    codec_.reset(avcodec_alloc_context3(codec));
    codec_->width = size.width;
    codec_->height = size.height;
    codec_->pix_fmt = AV_PIX_FMT_YUV420P;
    codec_->time_base = kTick;
    codec_->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
    av_opt_set(codec_->priv_data, "crf", options.quality, 0);
    av_opt_set(codec_->priv_data, "preset", "veryfast", 0);
    Check(avcodec_open2(codec_.get(), codec, nullptr) == 0);
    stream_ = avformat_new_stream(format, nullptr);
    Check(avcodec_parameters_from_context(stream_->codecpar, codec_.get()) >= 0);
    stream_->time_base = kTick;
    if (options.quarter_turns != 0) {
      auto* matrix = reinterpret_cast<std::int32_t*>(
          av_stream_new_side_data(stream_, AV_PKT_DATA_DISPLAYMATRIX, 9 * sizeof(std::int32_t)));
      av_display_rotation_set(matrix, 90.0 * options.quarter_turns);
    }
    Check(avio_open(&format->pb, path.c_str(), AVIO_FLAG_WRITE) >= 0);
    AVDictionary* movie = nullptr;
    if (options.index_first) {
      av_dict_set(&movie, "movflags", "+faststart", 0);
    }
    const int begun = avformat_write_header(format, &movie);
    av_dict_free(&movie);
    Check(begun >= 0);
    frame_.reset(av_frame_alloc());
    frame_->format = codec_->pix_fmt;
    frame_->width = size.width;
    frame_->height = size.height;
    Check(av_frame_get_buffer(frame_.get(), 0) >= 0);
    packet_.reset(av_packet_alloc());
    scaler_.reset(sws_getContext(size.width, size.height, AV_PIX_FMT_BGR24, size.width, size.height,
                                 codec_->pix_fmt, SWS_BICUBIC, nullptr, nullptr, nullptr));
  }

  void Add(const cv::Mat& bgr, double seconds) {
    Check(av_frame_make_writable(frame_.get()) >= 0);
    const std::uint8_t* const rows[] = {bgr.data};
    const int stride[] = {static_cast<int>(bgr.step[0])};
    sws_scale(scaler_.get(), rows, stride, 0, bgr.rows, frame_->data, frame_->linesize);
    frame_->pts = std::llround(seconds / av_q2d(kTick));
    Encode(frame_.get());
  }

  void Finish() {
    Encode(nullptr);
    Check(av_write_trailer(format_.get()) >= 0);
  }

 private:
  void Encode(AVFrame* frame) {
    Check(avcodec_send_frame(codec_.get(), frame) >= 0);
    while (avcodec_receive_packet(codec_.get(), packet_.get()) >= 0) {
      packet_->duration = 3000;  // of the last picture; the others end where the next begins
      av_packet_rescale_ts(packet_.get(), codec_->time_base, stream_->time_base);
      packet_->stream_index = stream_->index;
      Check(av_interleaved_write_frame(format_.get(), packet_.get()) >= 0);
    }
  }

  std::unique_ptr<AVFormatContext, Free> format_;
  std::unique_ptr<AVCodecContext, Free> codec_;
  AVStream* stream_ = nullptr;  // belongs to the format
  std::unique_ptr<AVFrame, Free> frame_;
  std::unique_ptr<AVPacket, Free> packet_;
  std::unique_ptr<SwsContext, Free> scaler_;
};

}  // namespace

void WriteFilm(const std::filesystem::path& path, const std::vector<double>& seconds,
               const std::function<cv::Mat(int)>& image, const FilmOptions& options) {
  av_log_set_level(AV_LOG_QUIET);
  Film film(path, image(0).size(), options);
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    film.Add(image(static_cast<int>(i)), seconds[i]);
  }
  film.Finish();
}

}  // namespace sqslam::testing
