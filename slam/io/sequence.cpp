#include "slam/io/sequence.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <opencv2/videoio.hpp>

#include "slam/io/camera_presets.h"
#include "slam/io/camera_yaml.h"
#include "slam/io/dataset_layouts.h"
#include "slam/io/detections.h"
#include "slam/io/image_files.h"
#include "slam/io/text_lines.h"
#include "slam/util/error.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// The calibration that was asked for, the sequence's own, or that of the dataset it comes from.
Camera CameraOf(const SequenceRequest& request, SequenceFormat format) {
  if (!request.camera.empty()) {
    return ReadCamera(CameraFile(request.camera));
  }
  const fs::path folder = fs::is_directory(request.path) ? request.path : request.path.parent_path();
  if (fs::exists(folder / "camera.yaml")) {
    return ReadCamera(folder / "camera.yaml");
  }
  const std::string preset = PresetOf(format, request.path);
  if (preset.empty()) {
    throw InputError(fmt::format(
        "{}: does not exist, expected the camera's calibration there, by --camera FILE.yaml or --camera "
        "PRESET ({})",
        (folder / "camera.yaml").string(), fmt::join(CameraPresetNames(), ", ")));
  }
  spdlog::info("{}: {} layout without camera.yaml, taken with --camera {}", request.path.string(),
               FormatName(format), preset);
  return ReadCamera(CameraFile(preset));
}

std::vector<SequenceFrame> ListTum(const fs::path& folder) {
  const fs::path list = folder / "rgb.txt";
  constexpr const char* kExpected = "'timestamp path'";
  std::vector<SequenceFrame> frames;
  for (const TextLine& line : ReadTextLines(list, "lines 'timestamp path'")) {
    if (line.words.size() < 2) {
      ThrowBadLine(list, line, kExpected);
    }
    const double timestamp = NumberAt(list, line, 0, kExpected);
    if (!frames.empty() && timestamp <= frames.back().timestamp) {
      ThrowBadLine(
          list, line,
          fmt::format("a timestamp after {:.6f}, that of the frame before", frames.back().timestamp));
    }
    const std::size_t name =
        line.text.find_first_not_of(" \t", line.words[0].size());  // a path may hold blanks
    frames.push_back({timestamp, folder / line.text.substr(name), {}});
  }
  if (frames.empty()) {
    throw InputError(
        fmt::format("{}: lists no image, expected at least one line 'timestamp path'", list.string()));
  }
  return frames;
}

// A folder below that holds images, for those who name the folder above; empty where there is none.
std::string HintBelow(const fs::path& folder) {
  std::vector<fs::path> below;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_directory() &&
        (DetectFormat(entry.path()) != SequenceFormat::kImages || !ListColorImages(entry.path()).empty())) {
      below.push_back(entry.path());
    }
  }
  std::sort(below.begin(), below.end());
  return below.empty() ? "" : fmt::format("; did you mean {}?", below.front().string());
}

std::vector<SequenceFrame> ListImages(const fs::path& folder, double fps) {
  std::vector<SequenceFrame> frames;
  for (const fs::path& image : ListColorImages(folder)) {
    frames.push_back({static_cast<double>(frames.size()) / fps, image, {}});
  }
  if (frames.empty()) {
    throw InputError(
        fmt::format("{}: no rgb.txt and no image in it, expected at least one (.png, .jpg, ...){}",
                    folder.string(), HintBelow(folder)));
  }
  return frames;
}

std::vector<SequenceFrame> ListVideo(const fs::path& path, const Camera& camera) {
  cv::VideoCapture video(path.string(), cv::CAP_FFMPEG);
  const double count = video.isOpened() ? video.get(cv::CAP_PROP_FRAME_COUNT) : 0.0;
  const double fps = video.isOpened() ? video.get(cv::CAP_PROP_FPS) : 0.0;
  if (!(count >= 1.0) || !(fps > 0.0)) {
    throw InputError(
        fmt::format("{}: cannot be read as a video (damaged, cut off, or none), expected a video file or a "
                    "sequence folder",
                    path.string()));
  }
  const auto width = static_cast<int>(video.get(cv::CAP_PROP_FRAME_WIDTH));
  const auto height = static_cast<int>(video.get(cv::CAP_PROP_FRAME_HEIGHT));
  if (width != camera.width || height != camera.height) {
    throw InputError(fmt::format("{}: is {}x{}, expected the camera's {}x{}", path.string(), width, height,
                                 camera.width, camera.height));
  }
  std::vector<SequenceFrame> frames(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].timestamp = static_cast<double>(i) / fps;
  }
  return frames;
}

void AttachDetections(const SequenceRequest& request, Sequence& sequence) {
  fs::path path = request.detections;
  if (path.empty() && fs::is_directory(request.path) && fs::exists(request.path / "boxes.txt")) {
    path = request.path / "boxes.txt";
  }
  if (path.empty()) {
    return;
  }
  if (!fs::exists(path)) {
    throw InputError(
        fmt::format("{}: does not exist, expected boxes.txt or a folder of box files", path.string()));
  }
  std::vector<double> timestamps;
  for (const SequenceFrame& frame : sequence.frames) {
    timestamps.push_back(frame.timestamp);
  }
  std::vector<std::vector<Detection>> detections = ReadDetections(path, sequence.camera, timestamps);
  for (std::size_t i = 0; i < detections.size(); ++i) {
    sequence.frames[i].detections = std::move(detections[i]);
  }
  sequence.has_detections = true;
}

}  // namespace

Sequence OpenSequence(const SequenceRequest& request) {
  const SequenceFormat detected = DetectFormat(request.path);
  const SequenceFormat format = request.format == SequenceFormat::kAuto ? detected : request.format;
  if ((format == SequenceFormat::kVideo) == fs::is_directory(request.path)) {
    throw InputError(fmt::format("{}: expected a {} for --format {}", request.path.string(),
                                 format == SequenceFormat::kVideo ? "video file" : "folder",
                                 FormatName(format)));
  }
  Sequence sequence;
  sequence.path = fs::absolute(request.path).lexically_normal();
  sequence.format = format;
  sequence.camera = CameraOf(request, format);
  switch (format) {
    case SequenceFormat::kTum:
      sequence.frames = ListTum(sequence.path);
      break;
    case SequenceFormat::kImages:
      sequence.frames = ListImages(sequence.path, sequence.camera.fps);
      break;
    case SequenceFormat::kVideo:
      sequence.frames = ListVideo(sequence.path, sequence.camera);
      sequence.video_path = sequence.path;
      break;
    default:
      sequence.frames = ListNumbered(format, sequence.path, sequence.camera.fps);
  }
  AttachDetections(request, sequence);
  return sequence;
}

}  // namespace sqslam
