#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "app/commands/commands.h"
#include "app/commands/render_arguments.h"
#include "app/result/highlight.h"
#include "app/result/map_input.h"
#include "slam/io/map_frame.h"
#include "slam/run/map_alignment.h"
#include "slam/scene/scene_diff.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/util/json_file.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kDiffNotes = R"(
Compares the objects of two results of one place: which stayed, moved, changed their size, are gone or new. The maps
are aligned by shared keyframes if one result extends the other (--extend, merge), otherwise as sqslam merge does; the
results stay unchanged. Uncertain objects are not compared.
An object without a counterpart is gone (or new) only if the other result shows its place empty: by the depth maps of
densified results (best), otherwise by keyframes that have all of it in view. Else it is not seen.

Examples:
  sqslam diff out/monday out/tuesday
  sqslam diff out/monday out/tuesday --picture changes.png --json changes.json
  sqslam diff out/tidy out/now --fail-on-change       exit code 5 if anything changed
)";

struct DiffArguments {
  std::string before;
  std::string after;
  ObjectArguments objects;
  std::string json;
  std::string picture;
  bool fail = false;
  StyleArguments style;
  RenderBackend backend = RenderBackend::kAuto;
  bool quiet = false;
};

std::vector<DepthMap> DepthsOf(const fs::path& recording) {
  const DepthRecording depths(recording);
  return ToVector(depths.Keyframes(), [&](std::int64_t keyframe) {
    DepthMap map = depths.Kept(keyframe);
    map.bgr.release();  // only the depth is needed
    return map;
  });
}

const SnapshotObject& ObjectOf(const ObjectChange& change, const MapSnapshot& before,
                               const MapSnapshot& after) {
  return change.before >= 0 ? before.objects[static_cast<std::size_t>(change.before)]
                            : after.objects[static_cast<std::size_t>(change.after)];
}

// "3 cup", or "-" for an object that the map does not have.
std::string IdIn(const MapSnapshot& map, int object) {
  return object < 0 ? "-" : std::to_string(map.objects[static_cast<std::size_t>(object)].id);
}

void PrintChanges(const std::vector<ObjectChange>& changes, const MapSnapshot& before,
                  const MapSnapshot& after) {
  fmt::print("{:<10} {:>6} {:>6} {:<16} {:>14} {:>12}\n", "change", "before", "after", "label",
             fmt::format("shift, {}", UnitOf(before)), "significance");
  for (const ObjectChange& change : changes) {
    const bool both = change.before >= 0 && change.after >= 0;
    const std::string amount = change.change == Change::kResized ? fmt::format("x {:.2f}", change.size_ratio)
                               : both                            ? fmt::format("{:.3f}", change.shift.norm())
                                                                 : "";
    fmt::print("{:<10} {:>6} {:>6} {:<16} {:>14} {:>12}\n", NameOf(change.change),
               IdIn(before, change.before), IdIn(after, change.after),
               ShownName(ObjectOf(change, before, after)), amount,
               both ? fmt::format("{:.1f}", change.significance) : "");
  }
}

void WriteChanges(const fs::path& file, const std::vector<ObjectChange>& changes, const MapSnapshot& before,
                  const MapSnapshot& after, const Sim3d& S_before_after) {
  using Json = nlohmann::ordered_json;
  Json root = {{"format", "sqslam-changes"},
               {"version", 1},
               {"unit", FrameOf(before).Unit()},
               {"S_before_after",
                {{"scale", S_before_after.scale},
                 {"rotation", S_before_after.rotation.coeffs()},
                 {"translation", S_before_after.translation}}}};
  const auto id = [](const MapSnapshot& map, int object) {
    return object < 0 ? Json() : Json(map.objects[static_cast<std::size_t>(object)].id);
  };
  root["objects"] = ToVector(changes, [&](const ObjectChange& change) {
    return Json{{"change", NameOf(change.change)},
                {"before", id(before, change.before)},
                {"after", id(after, change.after)},
                {"label", ObjectOf(change, before, after).label},
                {"shift", change.shift},
                {"size_ratio", change.size_ratio},
                {"significance", change.significance}};
  });
  CreateFolderOf(file);
  WriteJsonFile(file, root);
}

// Draws the first map with what is new in the second; what changed is solid, with what happened to it.
void DrawChanges(const DiffArguments& a, const std::vector<ObjectChange>& changes, const MapSnapshot& before,
                 const MapSnapshot& after, const Sim3d& S_before_after, const fs::path& recording) {
  MapSnapshot shown = before;
  std::set<int> chosen;
  for (const ObjectChange& change : changes) {
    int index = change.before;
    if (change.change == Change::kNew) {
      SnapshotObject object = after.objects[static_cast<std::size_t>(change.after)];
      object.superquadric = S_before_after * object.superquadric;
      index = static_cast<int>(shown.objects.size());
      shown.objects.push_back(object);
    }
    if (IsChange(change.change)) {
      SnapshotObject& object = shown.objects[static_cast<std::size_t>(index)];
      object.name = fmt::format("{}: {}", ReadableLabel(ShownName(object)), NameOf(change.change));
      chosen.insert(index);
    }
  }
  CreateFolderOf(a.picture);
  DrawHighlighted(shown, recording, chosen, a.style.Load(), a.backend, a.picture);
}

int Diff(const DiffArguments& a) {
  const fs::path first = MapFile(a.before), second = MapFile(a.after);
  const MapSnapshotPtr before = OpenMap(first, a.objects, HiddenObjects::kLeaveOut).Last();
  const MapSnapshotPtr after = OpenMap(second, a.objects, HiddenObjects::kLeaveOut).Last();
  const Sim3d S_before_after = AlignMaps(first, second);
  const std::vector<ObjectChange> changes =
      CompareScenes({before.get(), DepthsOf(first)}, {after.get(), DepthsOf(second)}, S_before_after);
  if (!a.quiet) {
    PrintChanges(changes, *before, *after);
  }
  if (!a.json.empty()) {
    WriteChanges(a.json, changes, *before, *after, S_before_after);
  }
  if (!a.picture.empty()) {
    DrawChanges(a, changes, *before, *after, S_before_after, first);
  }
  const auto count = std::ranges::count_if(changes, [](const ObjectChange& c) { return IsChange(c.change); });
  PrintSummary(a.quiet, "{} of {} objects changed\n", count, changes.size());
  return a.fail && count > 0 ? 5 : 0;
}

}  // namespace

void AddDiffCommand(Command& program) {
  const auto [command, a] =
      program.AddCommand("diff", "Find what changed between two results of one place", kDiffNotes, Diff);
  command.Group("Input");
  command.Positional("BEFORE", a.before, "Result folder of the earlier state").Required();
  command.Positional("AFTER", a.after, "Result folder of the later state").Required();
  AddObjectOptions(command, a.objects);
  command.Group("Output");
  command.Option("--json FILE", a.json, "Also write the changes and the alignment to FILE.json");
  command.Option(
      "--picture FILE", a.picture,
      "Also draw the map before to FILE.png: changed and new objects with names, others as faint outlines");
  command.Flag("--fail-on-change", a.fail,
               "Exit with code 5 if an object moved, changed its size, is gone or new");
  command.Group("Style");
  a.style.AddTo(command);
  AddBackendOption(command, a.backend);
  command.QuietFlag(a.quiet, "No table and no summary");
}

}  // namespace sqslam::app
