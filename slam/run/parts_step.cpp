#include "slam/run/parts_step.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "slam/io/map_frame.h"
#include "slam/io/result_files.h"
#include "slam/objects/object_class.h"
#include "slam/objects/part_fit.h"
#include "slam/run/map_to_extend.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/object_parts.h"
#include "slam/snapshot/recording.h"
#include "slam/system_options.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// An object whose class may have parts, with the lines of sight through its hull.
struct Candidate {
  const SnapshotObject* object = nullptr;
  const std::vector<PartTemplate>* templates = nullptr;
  std::vector<SightLine> lines = {};
};

void AddSightLines(const DepthRecording& depth, std::vector<Candidate>& candidates) {
  constexpr std::size_t kMaxLines = 2000;  // per object
  constexpr std::size_t kMinLinesOfMap = 25;
  const std::vector<std::int64_t> keyframes = depth.Keyframes();
  for (const std::int64_t keyframe : keyframes) {
    const DepthMap map = depth.Kept(keyframe);
    for (Candidate& candidate : candidates) {
      const std::vector<SightLine> lines = SightLinesThrough(
          candidate.object->superquadric, map, std::max(kMaxLines / keyframes.size(), kMinLinesOfMap));
      candidate.lines.insert(candidate.lines.end(), lines.begin(), lines.end());
    }
  }
}

}  // namespace

int FindParts(const fs::path& result) {
  const fs::path recording = result / "map.sqmap";
  StoreObjectParts(recording, {});
  const RecordingReader reader(recording);
  const MapSnapshotPtr map = reader.Last();
  const ObjectOptions options = OptionsOfRun(result).objects;
  const ClassTable classes = ClassTable::Named(options.class_priors);
  std::vector<Candidate> candidates;
  for (const SnapshotObject& object : map->objects) {
    if (const ObjectClass& prior = classes.Of(object.label);
        !prior.parts.empty() && options.representation == Representation::kSuperquadric) {
      candidates.push_back({&object, &prior.parts});
    }
  }
  if (!candidates.empty()) {
    AddSightLines(DepthRecording(recording), candidates);
  }
  const double metres = reader.Info().scale ? reader.Info().scale->metres : 1.0;
  std::vector<ObjectParts> found;
  for (const auto& [object, templates, lines] : candidates) {
    PartFit fit = FitParts(object->superquadric, *templates, lines);
    spdlog::debug("parts of {} {}: {} solids, log odds {:.1f} from {} lines of sight", object->id,
                  object->label, fit.parts.size(), fit.log_odds, lines.size());
    if (!fit.parts.empty()) {
      found.push_back({object->id, object->superquadric.shape.half_size / metres, std::move(fit.parts)});
    }
  }
  StoreObjectParts(recording, found);
  if (const fs::path file = result / "objects.json"; fs::exists(file)) {
    const MapSnapshotPtr with_parts = RecordingReader(recording).Last();
    WriteObjects(file, with_parts->objects, FrameOf(*with_parts));
  }
  return static_cast<int>(found.size());
}

}  // namespace sqslam
