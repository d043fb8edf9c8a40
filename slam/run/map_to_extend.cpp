#include "slam/run/map_to_extend.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "slam/io/cameras.h"
#include "slam/io/result_files.h"
#include "slam/io/sequence.h"
#include "slam/snapshot/recording.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/options.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

std::string CameraText(const Camera& c) {
  return fmt::format("{}x{}, fx {:.1f}, fy {:.1f}, cx {:.1f}, cy {:.1f}", c.width, c.height, c.fx, c.fy, c.cx,
                     c.cy);
}

// Returns the largest shift of a point in the image between the two cameras, px.
double LargestShift(const Camera& a, const Camera& b) {
  double largest = 0.0;
  for (const double x : {0.0, 0.5, 1.0}) {
    for (const double y : {0.0, 0.5, 1.0}) {
      const Eigen::Vector2d pixel(x * (a.width - 1), y * (a.height - 1));
      const Eigen::Vector3d ray = a.Unproject(a.Undistort(pixel));
      largest = std::max(largest, (b.ProjectDistorted(ray) - pixel).norm());
    }
  }
  return largest;
}

// Returns true if images of this size have the camera's aspect ratio, up to the rounding of a side.
bool IsScaled(cv::Size image, const Camera& camera) {
  const double height = static_cast<double>(camera.width) / image.width * image.height;
  return std::abs(height - camera.height) <= 1.0;
}

}  // namespace

Camera CameraInFiles(const MapToExtend& map) {
  const fs::path file = map.recording.parent_path() / "camera.yaml";
  if (!fs::exists(file)) {
    return map.map.camera;
  }
  const Camera written = ReadCamera(file);
  return ResizedCamera(map.map.camera, written.width, written.height);
}

SystemOptions OptionsOfRun(const fs::path& result) {
  const fs::path recording = ResultFile(result, "map.sqmap");
  SystemOptions options;
  try {
    ParseOptions(RecordingReader(recording).Info().config, "its options", options);
  } catch (const UsageError& error) {
    throw InputError("{}: {}", recording.string(), error.what());
  }
  return options;
}

MapToExtend ReadKnownMap(const fs::path& result) {
  const fs::path recording = ResultFile(result, "map.sqmap");
  return {recording, ReadSavedMap(recording), OptionsOfRun(result)};
}

void CheckSameCamera(const fs::path& source, const Camera& camera, const MapToExtend& map) {
  constexpr double kMaxShift = 0.02;  // of the image's width
  const Camera& known = map.map.camera;
  const bool same_size = camera.width == known.width && camera.height == known.height;
  ThrowIf<InputError>(
      !same_size || LargestShift(camera, known) > kMaxShift * known.width,
      "{}: its camera ({}) differs from that of {}, expected {} ({})", source.string(), CameraText(camera),
      map.recording.string(), CameraText(known),
      same_size ? fmt::format("an uncalibrated film of the same camera: map it again with --camera {}",
                              (map.recording.parent_path() / "camera.yaml").string())
                : fmt::format("--resize {},{} changes the size", known.width, known.height));
}

Sequence OpenSequenceFor(const MapToExtend& map, const SequenceRequest& request) {
  Sequence sequence = OpenSequence(request);
  const Camera& known = map.map.camera;
  if (request.resize.empty() && IsScaled(FileSize(sequence), known)) {
    SequenceRequest sized = request;
    sized.resize = fmt::format("{},{}", known.width, known.height);
    sequence = OpenSequence(sized);
  }
  Camera stated = known;  // an uncalibrated camera is assumed to be the map's
  stated.width = sequence.camera.width;
  stated.height = sequence.camera.height;
  CheckSameCamera(request.path, sequence.guessed_by.empty() ? sequence.camera : stated, map);
  const double fps = sequence.camera.fps;
  sequence.camera = known;  // what the map was optimised with
  sequence.camera.fps = fps;
  sequence.guessed_by.clear();
  return sequence;
}

namespace {

// Returns nothing if there are no image files to list.
std::optional<Sequence> ListFiles(const fs::path& path, const Camera& camera) {
  try {
    Sequence sequence = OpenSequence({.path = path, .known_camera = camera});
    return sequence.video_path.empty() ? std::optional(std::move(sequence)) : std::nullopt;
  } catch (const InputError&) {  // moved, deleted, or a live camera
    return std::nullopt;
  }
}

}  // namespace

fs::path WriteJoinedSequence(const fs::path& result, const fs::path& first, const fs::path& second,
                             const AddedFrames& added, const Camera& camera) {
  std::error_code error;
  if (added.index_shift == 0 && fs::equivalent(first, second, error)) {
    return first;
  }
  const std::optional<Sequence> a = ListFiles(first, camera);
  const std::optional<Sequence> b = ListFiles(second, camera);
  const std::int64_t begin = added.first - added.index_shift;  // of the frames of b that are listed
  if (!a || !b || begin < 0 || begin >= static_cast<std::int64_t>(b->frames.size())) {
    return {};
  }
  const std::int64_t listed = std::min(added.first, static_cast<std::int64_t>(a->frames.size()));
  const double first_time = b->frames[static_cast<std::size_t>(begin)].timestamp + added.time_shift;
  std::string text = "# timestamp path, of the frames of two sequences as the map numbers them\n";
  double time = -1.0;
  const auto list = [&](double timestamp, const fs::path& image) {
    text += fmt::format("{:.9f} {}\n", timestamp, fs::absolute(image).string());
    time = timestamp;
  };
  for (std::int64_t i = 0; i < listed; ++i) {
    const SequenceFrame& frame = a->frames[static_cast<std::size_t>(i)];
    list(frame.timestamp, frame.image_path);
  }
  if (time >= first_time) {
    return {};
  }
  // Frame numbers that neither sequence has are listed with any image, to keep the count.
  const double gap = (first_time - time) / static_cast<double>(added.first - listed + 1);
  for (std::int64_t i = listed; i < added.first; ++i) {
    list(time + gap, a->frames.back().image_path);
  }
  for (std::size_t i = static_cast<std::size_t>(begin); i < b->frames.size(); ++i) {
    list(b->frames[i].timestamp + added.time_shift, b->frames[i].image_path);
  }
  const fs::path folder = result / "sequence";
  fs::create_directories(folder);
  WriteCamera(folder / "camera.yaml", camera);
  WriteFileAtomically(folder / "rgb.txt", text);
  return fs::absolute(folder);
}

void WriteJoinedBoxes(const fs::path& result, const fs::path& first, const fs::path& second,
                      const AddedFrames& added) {
  std::set<std::string> boxes;  // a sequence that was mapped in two parts has the same boxes twice
  for (const auto& [folder, shift] : {std::pair(first, 0.0), std::pair(second, added.time_shift)}) {
    const fs::path file = folder / "boxes.txt";
    if (!fs::exists(file)) {
      continue;
    }
    for (const TextLine& line : ReadTextLines(file, "boxes of a result")) {
      const double time = NumberAt(file, line, 0, "'timestamp label score x y w h'");
      boxes.insert(fmt::format("{:.6f}{}\n", time + shift, line.text.substr(line.words[0].size())));
    }
  }
  if (!boxes.empty()) {
    WriteFileAtomically(
        result / "boxes.txt",
        fmt::format("# boxes of two sequences, at the times of the map\n{}", fmt::join(boxes, "")));
  }
}

}  // namespace sqslam
