#include "app/result/map_edits.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include "slam/util/error.h"

namespace sqslam::app {
namespace fs = std::filesystem;

void AddEditsOption(CLI::App& command, std::string& edits) {
  command
      .add_option("--edits", edits,
                  "FILE.json with edits of the objects (names, labels, hidden, deleted and merged ones), as "
                  "the viewer saves them; auto: the one beside the map. Without it the map as it was made")
      ->type_name("FILE");
}

fs::path EditsFile(const fs::path& recording, const std::string& edits) {
  if (edits != "auto") {
    return edits;
  }
  const fs::path beside = viewer::EditsFileOf(recording);
  if (!fs::exists(beside)) {
    throw InputError(
        fmt::format("--edits auto: {} does not exist, expected edits beside the map", beside.string()));
  }
  return beside;
}

RecordingReader OpenEdited(const fs::path& recording, const std::string& edits,
                           viewer::HiddenObjects hidden) {
  const fs::path file = EditsFile(recording, edits);
  if (file.empty()) {
    return RecordingReader(recording);
  }
  const viewer::ObjectEdits read = viewer::ReadObjectEdits(file);
  const RecordingReader plain(recording);
  if (plain.Size() > 0) {
    const std::vector<int> unknown = viewer::UnknownIds(read, *plain.Last());
    if (!unknown.empty()) {
      spdlog::warn("{}: the map has no object {}: are these edits of another map?", file.string(),
                   fmt::join(unknown, ", "));
    }
  }
  return RecordingReader(recording, [read, hidden](const MapSnapshotPtr& snapshot) {
    return viewer::Apply(read, *snapshot, hidden);
  });
}

}  // namespace sqslam::app
