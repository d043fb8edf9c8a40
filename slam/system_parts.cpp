#include "slam/system_parts.h"

#include <filesystem>
#include <memory>
#include <utility>

#include "slam/mapping/mapper.h"
#include "slam/util/data_path.h"
#include "slam/util/error.h"

namespace sqslam {

MapperOptions OptionsOfMapper(const SystemOptions& options) {
  return {options.deterministic, options.in_step,  static_cast<std::uint64_t>(options.seed),
          options.gravity,       options.tracking, options.mapping,
          options.objects,       options.database};
}

std::shared_ptr<const Vocabulary> LoadVocabulary(const SystemOptions& options) {
  const std::string& name = options.vocabulary;
  if (name == "none") {
    return nullptr;
  }
  return std::make_shared<const Vocabulary>(
      Vocabulary::Load(name == "auto" ? DataPath("assets/vocabulary.bin") : std::filesystem::path(name)));
}

std::shared_ptr<const Vocabulary> LoadVocabularyFor(const SavedMap& map, const std::string& name,
                                                    const SystemOptions& options) {
  std::shared_ptr<const Vocabulary> words = LoadVocabulary(options);
  if (!words) {
    throw UsageError(
        "vocabulary=none: an existing map needs visual words for relocalization, expected auto or a file");
  }
  if (!map.vocabulary.empty() && map.vocabulary != words->Fingerprint()) {
    throw InputError(
        "{}: was made with another vocabulary than {}, expected the same (--set vocabulary=FILE)", name,
        options.vocabulary == "auto" ? "the program's own" : options.vocabulary);
  }
  return words;
}

Map MainMapOf(const SavedMap& map, const std::string& name, const SystemOptions& options) {
  StageTimes times;
  Mapper mapper(map.camera, OptionsOfMapper(options), nullptr, {[](const AtlasViewPtr&) {}, {}, {}}, times);
  return std::move(mapper).MapOf(mapper.Restore(map.state, name, std::make_shared<IdSource>()).submap);
}

RunResult MergeMaps(const SavedMap& first, const std::string& first_name, const SavedMap& second,
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
