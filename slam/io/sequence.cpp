#include "slam/io/sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/videoio.hpp>
#include <set>

#include "slam/io/camera_yaml.h"
#include "slam/io/detections.h"
#include "slam/io/text_lines.h"
#include "slam/util/error.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

std::string LowerExtension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension;
}

bool IsImage(const fs::path& path) {
  static const std::set<std::string> kExtensions = {".png", ".jpg", ".jpeg", ".bmp",
                                                    ".ppm", ".tif", ".tiff", ".webp"};
  return kExtensions.contains(LowerExtension(path));
}

SequenceFormat DetectFormat(const fs::path& path) {
  if (!fs::exists(path)) {
    throw InputError(fmt::format("{}: does not exist, expected a sequence folder, an image folder or a video",
                                 path.string()));
  }
  if (!fs::is_directory(path)) {
    return SequenceFormat::kVideo;
  }
  return fs::exists(path / "rgb.txt") ? SequenceFormat::kTum : SequenceFormat::kImages;
}

Camera CameraOf(const SequenceRequest& request) {
  if (!request.camera_file.empty()) {
    return ReadCamera(request.camera_file);
  }
  const fs::path folder = fs::is_directory(request.path) ? request.path : request.path.parent_path();
  if (!fs::exists(folder / "camera.yaml")) {
    throw InputError(
        fmt::format("{}: does not exist, expected the camera's calibration there or by --camera FILE.yaml",
                    (folder / "camera.yaml").string()));
  }
  return ReadCamera(folder / "camera.yaml");
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

std::vector<SequenceFrame> ListImages(const fs::path& folder, double fps) {
  std::vector<fs::path> images;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file() && IsImage(entry.path())) {
      images.push_back(entry.path());
    }
  }
  if (images.empty()) {
    throw InputError(fmt::format("{}: no rgb.txt and no image in it, expected at least one (.png, .jpg, ...)",
                                 folder.string()));
  }
  std::sort(images.begin(), images.end());
  std::vector<SequenceFrame> frames;
  for (const fs::path& image : images) {
    frames.push_back({static_cast<double>(frames.size()) / fps, image, {}});
  }
  return frames;
}

std::vector<SequenceFrame> ListVideo(const fs::path& path) {
  cv::VideoCapture video(path.string(), cv::CAP_FFMPEG);
  const double count = video.isOpened() ? video.get(cv::CAP_PROP_FRAME_COUNT) : 0.0;
  const double fps = video.isOpened() ? video.get(cv::CAP_PROP_FPS) : 0.0;
  if (!(count >= 1.0) || !(fps > 0.0)) {
    throw InputError(fmt::format("{}: cannot be read as a video, expected a video file or a sequence folder",
                                 path.string()));
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
    throw InputError(fmt::format("{}: expected a {} for this --format", request.path.string(),
                                 format == SequenceFormat::kVideo ? "video file" : "folder"));
  }
  Sequence sequence;
  sequence.path = fs::absolute(request.path).lexically_normal();
  sequence.camera = CameraOf(request);
  switch (format) {
    case SequenceFormat::kTum:
      sequence.frames = ListTum(sequence.path);
      break;
    case SequenceFormat::kImages:
      sequence.frames = ListImages(sequence.path, sequence.camera.fps);
      break;
    default:
      sequence.frames = ListVideo(sequence.path);
      sequence.video_path = sequence.path;
  }
  AttachDetections(request, sequence);
  return sequence;
}

}  // namespace sqslam
