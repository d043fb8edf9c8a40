#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <vector>

struct AVFormatContext;
struct AVStream;

namespace sqslam {

// The video stream of a file that is meant: no cover picture; of several, the default one, then the one with
// most pixels, then the first.
struct VideoStream {
  std::unique_ptr<AVFormatContext, void (*)(AVFormatContext*)> format;
  AVStream* stream;
  int others = 0;  // further streams of video
};

// Returns the name by which FFmpeg opens a file: the absolute path, because it would take the beginning of
// "12:30.mp4" for a protocol.
std::string FfmpegName(const std::filesystem::path& path);

// Returns the size of pictures of this size in the stream when their pixels are square: anamorphic ones are
// widened or narrowed.
cv::Size SquarePixels(const AVStream& stream, cv::Size picture);

// Throws InputError if there is none. `message`: format of the error, with the file and FFmpeg's reason.
VideoStream OpenVideoStream(const std::filesystem::path& path, const char* message);

std::string FfmpegReason(int error);  // in words

// A video file's frames as the container lists them, without decoding any.
struct VideoIndex {
  int width = 0;  // square pixels, before rotation
  int height = 0;
  cv::Size stored;                 // pixels as stored, which may be not square
  int quarter_turns = 0;           // clockwise, 0 to 3, to show the picture upright (a phone's rotation flag)
  double fps = 0.0;                // mean rate
  std::vector<double> timestamps;  // seconds from the first frame, in the order shown, rising
  // The same in the stream's units, as the decoder gives them; empty if the container has none.
  std::vector<std::int64_t> times;

  // Returns width and height after rotation.
  std::pair<int, int> ShownSize() const {
    return quarter_turns % 2 == 0 ? std::pair(width, height) : std::pair(height, width);
  }
};

// Reads the packets of the video stream. Frames before the first one that can be decoded, in a recording that
// was cut, are not listed. Timestamps are the container's, which keeps variable frame rates (phones, screen
// recordings); if it has none (bare H.264), frames are evenly spaced. Warns if the file has fewer frames than
// it announces. Throws InputError with the reason if nothing can be read: no video, a format that FFmpeg does
// not know, truncated before its index (an MP4's moov).
VideoIndex IndexVideo(const std::filesystem::path& path);

}  // namespace sqslam
