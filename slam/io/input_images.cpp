#include "slam/io/input_images.h"

#include <filesystem>

#include "slam/io/image_files.h"

namespace sqslam {
namespace {

bool IsThere(const std::string& file) {
  std::error_code error;
  return !file.empty() && std::filesystem::is_regular_file(file, error);
}

}  // namespace

InputImages::InputImages(const RecordingReader& recording) : camera_(recording.Last()->camera) {
  if (recording.Info().sequence_path.empty()) {
    why_not_ = "its frames are from two inputs, at least one of them a video or missing";
    return;
  }
  try {
    sequence_ = OpenSequence({.path = recording.Info().sequence_path, .known_camera = camera_});
  } catch (const std::exception& error) {  // moved, deleted, or a live camera
    why_not_ = error.what();
  }
}

cv::Mat InputImages::Read(std::int64_t frame) {
  if (!sequence_ || frame < 0 || frame >= static_cast<std::int64_t>(sequence_->frames.size())) {
    return {};
  }
  if (sequence_->video_path.empty()) {
    return ReadImageInSize(sequence_->frames[static_cast<std::size_t>(frame)].image_path.string(),
                           {camera_.width, camera_.height});
  }
  // A video opened anew is decoded from its start, but without handing out the frames on the way.
  if (!source_ || frame < next_ || frame - next_ > next_) {
    source_ = std::make_unique<FrameSource>(*sequence_, FrameRange{.start = frame}, 2);
    next_ = frame;
  }
  while (std::optional<Frame> read = source_->Next()) {
    next_ = read->index + 1;
    if (read->index >= frame) {
      return read->index == frame ? read->bgr : cv::Mat();  // a later one: this frame was unreadable
    }
  }
  return {};
}

cv::Mat InputImages::Read(const std::string& file, std::int64_t frame) {
  const cv::Mat image = IsThere(file) ? ReadImageInSize(file, {camera_.width, camera_.height}) : cv::Mat();
  return image.empty() ? Read(frame) : image;
}

cv::Mat InputImages::Read(const std::map<std::int64_t, std::string>& files, std::int64_t frame) {
  const auto file = files.find(frame);
  return Read(file == files.end() ? "" : file->second, frame);
}

bool InputImages::Has(const MapSnapshot& map) const {
  if (IsThere(map.image_path)) {
    return true;
  }
  if (!sequence_ || map.frame_index < 0 ||
      map.frame_index >= static_cast<std::int64_t>(sequence_->frames.size())) {
    return false;
  }
  return !sequence_->video_path.empty() ||
         IsThere(sequence_->frames[static_cast<std::size_t>(map.frame_index)].image_path.string());
}

}  // namespace sqslam
