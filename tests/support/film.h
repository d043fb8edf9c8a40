#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

namespace sqslam::testing {

// A video like those of phones: individual display times for all pictures, and a rotation flag. MP4, H.264
// (MPEG-4 where FFmpeg has no x264).
struct FilmOptions {
  int quarter_turns = 0;       // clockwise, to be applied by a player
  bool index_first = false;    // the file's index at its start, so that a cut-off file can still be read
  const char* quality = "12";  // x264's crf: 0 is exact
};

// `image` gives the pictures (8UC3, all of one even size), `seconds` are the times at which they are shown,
// rising from 0.
void WriteFilm(const std::filesystem::path& path, const std::vector<double>& seconds,
               const std::function<cv::Mat(int)>& image, const FilmOptions& options = {});

}  // namespace sqslam::testing
