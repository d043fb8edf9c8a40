#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "slam/io/frame_source.h"
#include "slam/io/sequence.h"
#include "slam/snapshot/recording.h"

namespace sqslam {

// Throws InputError if an image of the recording has a different number in the sequence than when mapped:
// frames would get the wrong images. Renamed (for example converted) and missing files are not
// checked.
void CheckNumbering(const RecordingReader& recording, const Sequence& sequence);

// The images that a recording was made from, in files or in a video. Not thread-safe.
class InputImages {
 public:
  // Never throws: WhyNot() gives the reason for missing images.
  explicit InputImages(const RecordingReader& recording);
  explicit InputImages(const Sequence& sequence) : camera_(sequence.camera), sequence_(sequence) {}

  // Returns an image, 8UC3 in the size of the recording's camera; empty if it is missing. Reading frames in
  // ascending order is fastest.
  cv::Mat Read(std::int64_t frame);
  cv::Mat Read(const MapSnapshot& map) { return Read(map.image_path, map.frame_index); }
  cv::Mat Read(const std::string& file, std::int64_t frame);  // from the file if it still exists
  cv::Mat Read(const std::map<std::int64_t, std::string>& files, std::int64_t frame);  // files of frames

  // Returns true if the image's file (or video) exists; it is not read.
  bool Has(const MapSnapshot& map) const;

  // Returns the sequence, with images in the size of the recording's camera; null if it is missing.
  const Sequence* FindSequence() const { return sequence_ ? &*sequence_ : nullptr; }

  const std::string& WhyNot() const { return why_not_; }

 private:
  Camera camera_;
  std::optional<Sequence> sequence_;
  std::unique_ptr<FrameSource> source_;
  std::int64_t next_ = 0;  // frame that source_ gives next
  std::string why_not_ = "this image cannot be read";
};

}  // namespace sqslam
