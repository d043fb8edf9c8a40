#include "slam/run/map_alignment.h"

#include <Eigen/Core>
#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "slam/geometry/similarity_alignment.h"
#include "slam/run/map_to_extend.h"
#include "slam/snapshot/recording.h"
#include "slam/system_parts.h"
#include "slam/util/error.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

using PosePairs = std::pair<std::vector<Rigid3d>, std::vector<Rigid3d>>;

// Pairs keyframes by their frames: frame `index` of the source is frame index + `shift` of the target.
PosePairs PairKeyframes(const MapSnapshot& source, const MapSnapshot& target, std::int64_t shift,
                        const std::function<bool(const SnapshotKeyframe&, const SnapshotKeyframe&)>& same) {
  std::map<std::int64_t, const SnapshotKeyframe*> by_frame;
  for (const SnapshotKeyframe& keyframe : target.keyframes) {
    by_frame[keyframe.frame_index] = &keyframe;
  }
  PosePairs pairs;
  for (const SnapshotKeyframe& keyframe : source.keyframes) {
    const auto it = by_frame.find(keyframe.frame_index + shift);
    if (it != by_frame.end() && same(keyframe, *it->second)) {
      pairs.first.push_back(keyframe.T_map_camera);
      pairs.second.push_back(it->second->T_map_camera);
    }
  }
  return pairs;
}

// Aligns maps of which one contains the other: most keyframes of the smaller are in both, at the same places.
// Ids and times alone may agree by chance.
std::optional<Sim3d> AlignSharedKeyframes(const MapSnapshot& source, const MapSnapshot& target) {
  constexpr double kMaxError = 0.02;  // of the keyframes' distance from their centre
  const auto [from, to] = PairKeyframes(source, target, 0, [](const auto& a, const auto& b) {
    return a.id == b.id && a.timestamp == b.timestamp;
  });
  const std::optional<Sim3d> S = AlignPoses(from, to);
  if (!S || 2 * from.size() < std::min(source.keyframes.size(), target.keyframes.size())) {
    return std::nullopt;
  }
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Rigid3d& pose : to) {
    centre += pose.translation / static_cast<double>(to.size());
  }
  double error = 0.0, spread = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    error += (*S * from[i].translation - to[i].translation).squaredNorm();
    spread += (to[i].translation - centre).squaredNorm();
  }
  return error < kMaxError * kMaxError * spread ? S : std::nullopt;
}

}  // namespace

Sim3d AlignMaps(const fs::path& first, const fs::path& second) {
  const MapToExtend a = ReadKnownMap(first);
  const MapToExtend b = ReadKnownMap(second);
  const MapSnapshotPtr map_a = RecordingReader(a.recording).Last();
  const MapSnapshotPtr map_b = RecordingReader(b.recording).Last();
  if (const std::optional<Sim3d> S = AlignSharedKeyframes(*map_b, *map_a)) {
    return *S;
  }
  CheckSameCamera(b.recording, b.map.camera, a);
  const RunResult merged = MergeMaps(a.map, a.recording.string(), b.map, b.recording.string(), a.options);
  const MapSnapshot& both = *merged.map.snapshot;
  const std::int64_t first_added = merged.added->first;
  const auto [from_a, to_a] =
      PairKeyframes(*map_a, both, 0, [&](const SnapshotKeyframe&, const SnapshotKeyframe& keyframe) {
        return keyframe.frame_index < first_added;
      });
  const auto [from_b, to_b] =
      PairKeyframes(*map_b, both, merged.added->index_shift,
                    [](const SnapshotKeyframe&, const SnapshotKeyframe&) { return true; });
  const std::optional<Sim3d> S_merged_a = AlignPoses(from_a, to_a), S_merged_b = AlignPoses(from_b, to_b);
  if (!S_merged_a || !S_merged_b) {
    throw NoMapError("{} and {}: too few keyframes are left to align the maps", a.recording.string(),
                     b.recording.string());
  }
  return S_merged_a->Inverse() * *S_merged_b;
}

}  // namespace sqslam
