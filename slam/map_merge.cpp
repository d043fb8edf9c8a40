#include "slam/map_merge.h"

#include <memory>
#include <utility>

#include "slam/mapping/mapper.h"
#include "slam/system_parts.h"
#include "slam/util/error.h"

namespace sqslam {

RunResult MergeMaps(const KeptMap& first, const std::string& first_name, const KeptMap& second,
                    const std::string& second_name, const SystemOptions& options) {
  const std::shared_ptr<const Vocabulary> vocabulary = LoadVocabularyFor(first, first_name, options);
  LoadVocabularyFor(second, second_name, options);
  StageTimes times;
  Mapper mapper(first.camera, OptionsOfMapper(options), vocabulary,
                {[](const AtlasViewPtr&) {}, [](const MapSnapshotPtr&) {}, {}}, times);
  const auto ids = std::make_shared<IdSource>();
  mapper.Restore(first.state, first_name, ids);
  const Mapper::Restored added = mapper.Restore(second.state, second_name, ids);
  if (!mapper.TieToOthers(added.submap)) {
    throw NoMapError("{} and {}: show no common place, expected maps that overlap", first_name, second_name);
  }
  RunResult result;
  result.others = mapper.Finish();
  result.map = std::move(result.others.front());
  result.others.erase(result.others.begin());
  result.frames = result.tracked = static_cast<int>(result.map.trajectory.size());
  result.counters = mapper.Counters();
  result.timing_ms = times.Summaries();
  result.added = {added.oldest_frame, added.index_shift, added.time_shift};
  result.kept = {mapper.GetCamera(), vocabulary->Fingerprint(), mapper.Save()};
  return result;
}

}  // namespace sqslam
