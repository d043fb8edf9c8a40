#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

struct AVFormatContext;
struct AVStream;

namespace sqslam {

// The first video stream of a file.
struct VideoStream {
  std::unique_ptr<AVFormatContext, void (*)(AVFormatContext*)> format;
  AVStream* stream;
};

// Throws InputError where there is none: `complaint` with the file and FFmpeg's reason put in.
VideoStream OpenVideoStream(const std::filesystem::path& path, const char* complaint);

std::string FfmpegReason(int error);  // in words

// A video file's frames as the container lists them, found without decoding any.
struct VideoIndex {
  int width = 0;  // pixels as stored, before the turn
  int height = 0;
  int quarter_turns = 0;  // clockwise, 0 to 3, until the picture stands upright (a phone's rotation flag)
  double fps = 0.0;       // mean rate
  std::vector<double> timestamps;  // seconds from the first frame, in the order shown, rising

  // Width and height after the turn.
  std::pair<int, int> ShownSize() const {
    return quarter_turns % 2 == 0 ? std::pair(width, height) : std::pair(height, width);
  }
};

// Reads the packets of the first video stream. Timestamps are the container's own, so that a variable frame
// rate (phones, screen recordings) keeps its times; where a container has none (bare H.264), frames are
// evenly spaced. Warns where the file ends before the frames that it promises. Throws InputError that says
// why nothing can be read: no video, a format FFmpeg does not know, cut off before its index (an MP4's moov).
VideoIndex IndexVideo(const std::filesystem::path& path);

}  // namespace sqslam
