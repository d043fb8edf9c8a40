#include "app/figures/object_views.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>

#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam::app {

std::map<int, std::vector<ObjectView>> ObjectViews(const RecordingReader& reader, const MapSnapshot& last,
                                                   bool all) {
  constexpr std::size_t kMostRead = 300;
  std::map<std::int64_t, Rigid3d> poses;
  for (const SnapshotKeyframe& keyframe : last.keyframes) {
    poses[keyframe.frame_index] = keyframe.T_map_camera;
  }
  std::vector<int> of_keyframes;  // numbers of snapshots
  std::set<std::int64_t> seen;
  for (int i = 0; i < reader.Size(); ++i) {
    if (poses.contains(reader.FrameIndex(i)) && seen.insert(reader.FrameIndex(i)).second) {
      of_keyframes.push_back(i);
    }
  }
  std::map<int, std::vector<ObjectView>> views;
  const std::size_t step = all ? 1 : std::max<std::size_t>(1, of_keyframes.size() / kMostRead);
  for (std::size_t i = 0; i < of_keyframes.size(); i += step) {
    const MapSnapshotPtr moment = reader.Read(of_keyframes[i]);
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

std::vector<ObjectView> ViewsOfFrame(const std::vector<ObjectView>& views, std::optional<std::int64_t> frame,
                                     const std::string& what) {
  if (views.empty()) {
    throw InputError(
        fmt::format("{}: no keyframe with its image and a box of it, expected a map made from images that "
                    "are still there",
                    what));
  }
  if (!frame) {
    return views;
  }
  std::vector<ObjectView> chosen;
  std::vector<std::string> known;
  for (const ObjectView& view : views) {
    if (view.frame_index == *frame) {
      chosen.push_back(view);
    }
    known.push_back(std::to_string(view.frame_index));
  }
  if (chosen.empty()) {
    throw InputError(
        fmt::format("{}: not in a keyframe {}, expected one of {}", what, *frame, fmt::join(known, ", ")));
  }
  return chosen;
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

}  // namespace sqslam::app
