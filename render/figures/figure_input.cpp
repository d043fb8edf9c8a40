#include "render/figures/figure_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>

#include "slam/evaluation/comparison.h"
#include "slam/io/image_files.h"
#include "slam/io/result_files.h"
#include "slam/util/error.h"

namespace sqslam {

std::vector<std::string> ResultNames(const FigureRequest& request) {
  if (request.names.empty()) {
    return ShortNames({request.results.begin(), request.results.end()});
  }
  if (request.names.size() != request.results.size()) {
    throw UsageError(fmt::format("--name: {} for {}, expected one for each result in their order",
                                 request.names.size(), request.results.size()));
  }
  return request.names;
}

std::vector<double> ParseNumberList(const std::string& option, const std::string& text) {
  std::vector<double> numbers;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (true) {
    double number = 0.0;
    const auto [next, error] = std::from_chars(at, end, number);
    if (error != std::errc() || (next != end && *next != ',')) {
      throw UsageError(
          fmt::format("{} {}: expected numbers with commas between them, such as 0.1,1", option, text));
    }
    numbers.push_back(number);
    if (next == end) {
      return numbers;
    }
    at = next + 1;
  }
}

RecordedMap OpenMap(const std::string& result) {
  auto reader = std::make_unique<RecordingReader>(ResultFile(result, "map.sqmap"));
  if (reader->Size() == 0) {
    throw InputError(fmt::format("{}: holds no snapshot, expected a map", result));
  }
  MapSnapshotPtr last = reader->Last();
  return {std::move(reader), std::move(last)};
}

RecordedMap OpenObjectMap(const std::string& result) {
  RecordedMap map = OpenMap(result);
  if (map.last->objects.empty()) {
    throw InputError(fmt::format("{}: holds no object, expected a map with objects", result));
  }
  return map;
}

SystemOptions ConfigOf(const RecordingReader& reader) {
  SystemOptions options;
  try {
    ParseOptions(reader.Info().config, "map.sqmap", options);
  } catch (const UsageError&) {
    return {};
  }
  return options;
}

const SnapshotObject& ObjectById(const MapSnapshot& map, int id, const std::string& result) {
  std::vector<std::string> known;
  for (const SnapshotObject& object : map.objects) {
    if (object.id == id) {
      return object;
    }
    known.push_back(fmt::format("{} {}", object.id, object.label));
  }
  throw InputError(
      fmt::format("{}: has no object {}, expected one of {}", result, id, fmt::join(known, ", ")));
}

std::map<int, std::vector<ObjectView>> ObjectViews(const RecordedMap& map, bool all) {
  constexpr std::size_t kMostRead = 300;
  std::map<std::int64_t, Rigid3d> poses;
  for (const SnapshotKeyframe& keyframe : map.last->keyframes) {
    poses[keyframe.frame_index] = keyframe.T_map_camera;
  }
  std::vector<int> of_keyframes;  // numbers of snapshots
  std::set<std::int64_t> seen;
  for (int i = 0; i < map.reader->Size(); ++i) {
    if (poses.contains(map.reader->FrameIndex(i)) && seen.insert(map.reader->FrameIndex(i)).second) {
      of_keyframes.push_back(i);
    }
  }
  std::map<int, std::vector<ObjectView>> views;
  const std::size_t step = all ? 1 : std::max<std::size_t>(1, of_keyframes.size() / kMostRead);
  for (std::size_t i = 0; i < of_keyframes.size(); i += step) {
    const MapSnapshotPtr moment = map.reader->Read(of_keyframes[i]);
    std::error_code error;
    if (moment->image_path.empty() || !std::filesystem::is_regular_file(moment->image_path, error)) {
      continue;
    }
    for (const SnapshotDetection& seen_box : moment->detections) {
      if (seen_box.object_id >= 0) {
        views[seen_box.object_id].push_back(
            {moment->frame_index, moment->image_path, poses.at(moment->frame_index), seen_box.detection.box});
      }
    }
  }
  return views;
}

std::vector<ObjectView> ViewsOfFrame(const std::vector<ObjectView>& views, const FigureRequest& request,
                                     const std::string& what) {
  if (views.empty()) {
    throw InputError(
        fmt::format("{}: no keyframe with its image and a box of it, expected a map made from images that "
                    "are still there",
                    what));
  }
  if (request.frames.empty()) {
    return views;
  }
  std::vector<ObjectView> chosen;
  std::vector<std::string> known;
  for (const ObjectView& view : views) {
    if (view.frame_index == request.frames.front()) {
      chosen.push_back(view);
    }
    known.push_back(std::to_string(view.frame_index));
  }
  if (chosen.empty()) {
    throw InputError(fmt::format("{}: not in a keyframe {}, expected one of {}", what, request.frames.front(),
                                 fmt::join(known, ", ")));
  }
  return chosen;
}

cv::Mat ImageOf(const ObjectView& view, const Camera& camera) {
  cv::Mat image = ReadImageInSize(view.image_path, {camera.width, camera.height});
  if (image.cols != camera.width || image.rows != camera.height) {
    throw InputError(fmt::format("{}: {}x{} pixels, expected an image of {}x{}", view.image_path, image.cols,
                                 image.rows, camera.width, camera.height));
  }
  return image;
}

int UprightTurns(const ObjectView& view, const MapSnapshot& map) {
  constexpr double kLeastUpright = 0.35;  // sine of the angle between line of sight and up
  const Eigen::Vector3d up = view.T_map_camera.RotationMatrix().transpose() * Eigen::Vector3d::UnitZ();
  if (!map.gravity_known || up.head<2>().norm() < kLeastUpright) {
    return 0;
  }
  const double clockwise = std::atan2(up.x(), -up.y());  // of up in the image
  return (4 - static_cast<int>(std::lround(clockwise / (0.5 * std::numbers::pi)))) % 4;
}

}  // namespace sqslam
