#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace sqslam {

// Decodes the frames that IndexVideo() lists, in ascending order: 8UC3 (BGR), with square pixels, not
// rotated. The matrix and range of colours are those that the file states; without a statement BT.709 for HD
// (a width of at least 1280 or a height above 576, as players assume) and BT.601 below, in limited range. Not
// thread-safe.
class VideoReader {
 public:
  // `times`: VideoIndex::times. Throws InputError if the file cannot be opened.
  VideoReader(const std::filesystem::path& path, std::vector<std::int64_t> times);
  ~VideoReader();

  // Returns the frame of this number, which is higher than that of the call before; nothing if it cannot be
  // decoded. Frames on the way are decoded, but not converted.
  std::optional<cv::Mat> Read(std::int64_t index);

  // Returns true if the file ended before the frame that was asked for last.
  bool Ended() const;

  std::int64_t Decoded() const;  // frames so far

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
