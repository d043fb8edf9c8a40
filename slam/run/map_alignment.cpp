#include "slam/run/map_alignment.h"

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "slam/geometry/similarity_alignment.h"
#include "slam/run/map_to_extend.h"
#include "slam/snapshot/recording.h"
#include "slam/system_parts.h"
#include "slam/util/error.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// Aligns keyframes by their frames. Frame `index` of the source is frame index + `shift` of the target.
std::optional<Sim3d> AlignKeyframes(
    const MapSnapshot& source, const MapSnapshot& target, std::int64_t shift,
    const std::function<bool(const SnapshotKeyframe&, const SnapshotKeyframe&)>& same) {
  std::map<std::int64_t, const SnapshotKeyframe*> by_frame;
  for (const SnapshotKeyframe& keyframe : target.keyframes) {
    by_frame[keyframe.frame_index] = &keyframe;
  }
  std::vector<Rigid3d> from, to;
  for (const SnapshotKeyframe& keyframe : source.keyframes) {
    const auto it = by_frame.find(keyframe.frame_index + shift);
    if (it != by_frame.end() && same(keyframe, *it->second)) {
      from.push_back(keyframe.T_map_camera);
      to.push_back(it->second->T_map_camera);
    }
  }
  return AlignPoses(from, to);
}

bool AreOneKeyframe(const SnapshotKeyframe& a, const SnapshotKeyframe& b) {
  return a.id == b.id && a.timestamp == b.timestamp;
}

}  // namespace

Sim3d AlignMaps(const fs::path& first, const fs::path& second) {
  const MapToExtend a = ReadKnownMap(first);
  const MapToExtend b = ReadKnownMap(second);
  const RecordingReader reader_a(a.recording), reader_b(b.recording);
  const MapSnapshotPtr map_a = reader_a.Last(), map_b = reader_b.Last();
  if (reader_a.Info().sequence_path == reader_b.Info().sequence_path) {
    if (const auto S = AlignKeyframes(*map_b, *map_a, 0, AreOneKeyframe)) {
      return *S;
    }
  }
  CheckSameCamera(b.recording, b.map.camera, a);
  const RunResult merged = MergeMaps(a.map, a.recording.string(), b.map, b.recording.string(), a.options);
  const MapSnapshot& both = *merged.map.snapshot;
  const std::int64_t first_added = merged.added->first;
  const auto S_merged_a =
      AlignKeyframes(*map_a, both, 0, [&](const SnapshotKeyframe&, const SnapshotKeyframe& keyframe) {
        return keyframe.frame_index < first_added;
      });
  const auto S_merged_b =
      AlignKeyframes(*map_b, both, merged.added->index_shift,
                     [](const SnapshotKeyframe&, const SnapshotKeyframe&) { return true; });
  if (!S_merged_a || !S_merged_b) {
    throw NoMapError("{} and {}: too few keyframes are left to align the maps", a.recording.string(),
                     b.recording.string());
  }
  return S_merged_a->Inverse() * *S_merged_b;
}

}  // namespace sqslam
