#include "slam/io/input_images.h"

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <utility>

#include "slam/io/image_files.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

bool IsThere(const std::string& file) {
  std::error_code error;
  return !file.empty() && std::filesystem::is_regular_file(file, error);
}

// Returns a state of the recording; null if it is damaged.
MapSnapshotPtr ReadIfWhole(const RecordingReader& recording, int state) {
  try {
    return recording.Read(state);
  } catch (const InputError&) {
    return nullptr;
  }
}

}  // namespace

void CheckNumbering(const RecordingReader& recording, const Sequence& sequence) {
  std::map<std::string, std::size_t> numbers;  // by file name; the first, if several have the name
  for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
    numbers.emplace(sequence.frames[i].image_path.filename().string(), i);
  }
  for (const int state : std::set{0, recording.Size() / 2, recording.Size() - 1}) {
    const MapSnapshotPtr map = ReadIfWhole(recording, state);
    if (!map || map->image_path.empty()) {
      continue;
    }
    const std::string name = std::filesystem::path(map->image_path).filename().string();
    const auto frame = static_cast<std::size_t>(map->frame_index);
    const auto number = numbers.find(name);
    const bool same =
        HasFrame(sequence, map->frame_index) && sequence.frames[frame].image_path.filename().string() == name;
    if (number != numbers.end() && !same) {
      throw InputError(
          "{}: {} is image {} there (from 0), but image {} of the map, expected the images that were mapped, "
          "none added or removed",
          sequence.path.string(), name, number->second, map->frame_index);
    }
  }
}

InputImages::InputImages(const RecordingReader& recording) : camera_(recording.Last()->camera) {
  if (recording.Info().sequence_path.empty()) {
    why_not_ = "its frames are from two inputs, at least one of them a video or missing";
    return;
  }
  try {
    Sequence sequence = OpenSequence({.path = recording.Info().sequence_path, .known_camera = camera_});
    CheckNumbering(recording, sequence);
    sequence_ = std::move(sequence);
  } catch (const std::exception& error) {  // moved, deleted, changed, or a live camera
    why_not_ = error.what();
  }
}

cv::Mat InputImages::Read(std::int64_t frame) {
  if (!sequence_ || !HasFrame(*sequence_, frame)) {
    return {};
  }
  if (sequence_->video_path.empty()) {
    return ReadImageInSize(sequence_->frames[static_cast<std::size_t>(frame)].image_path.string(),
                           {camera_.width, camera_.height}, cv::IMREAD_COLOR, sequence_->value_range);
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
  const cv::Mat image = IsThere(file)
                            ? ReadImageInSize(file, {camera_.width, camera_.height}, cv::IMREAD_COLOR,
                                              sequence_ ? sequence_->value_range : std::nullopt)
                            : cv::Mat();
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
  if (!sequence_ || !HasFrame(*sequence_, map.frame_index)) {
    return false;
  }
  return !sequence_->video_path.empty() ||
         IsThere(sequence_->frames[static_cast<std::size_t>(map.frame_index)].image_path.string());
}

}  // namespace sqslam
