#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Core>
#include <algorithm>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/commands/commands.h"
#include "app/commands/render_arguments.h"
#include "app/export/map_view.h"
#include "app/result/highlight.h"
#include "app/result/map_input.h"
#include "slam/io/map_frame.h"
#include "slam/scene/query.h"
#include "slam/scene/scene_graph.h"
#include "slam/util/json_file.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kQueryNotes = R"(
A question is a kind of objects, with any number of conditions:
  cups on the table              relations: on, in, under, above, next to, leaning against
  cups and bottles not on the floor
  largest book, 2 tallest things, certain chairs, chair 4
  cup nearest to the laptop      or farthest from
  objects within 0.5 m of bottle 3    between surfaces; in a map without scale: 2 units
  chairs left of the table seen from 120    also right of, in front of, behind; 120 is a frame
Kinds are labels, names given in the viewer, and synonyms (configs/classes.yaml), in the singular or plural; "objects"
are all. If no table was mapped as an object, a horizontal surface is one. Relations are those of relations.json,
after edits: an answer holds with a probability of at least 0.5.

Examples:
  sqslam query out/kitchen "cups on the table"
  sqslam query out/kitchen "largest box next to the sink" --picture box.png
  sqslam query out/kitchen "certain chairs under the table" --json
)";

struct QueryArguments {
  std::string map;
  std::string question;
  ObjectArguments objects;
  bool json = false;
  std::string picture;
  StyleArguments style;
  RenderBackend backend = RenderBackend::kAuto;
};

// Returns for each object the frames of up to three keyframes with a box of it, those that show most of it
// first.
std::vector<std::vector<std::int64_t>> BestFrames(const RecordingReader& reader, const MapSnapshot& map) {
  constexpr std::size_t kFrames = 3;
  constexpr double kTolerance = 2.0;  // px
  std::vector<SeenOutline> outlines = FindOutlines(map, ReadHistory(reader), kTolerance);
  std::erase_if(outlines, [](const SeenOutline& outline) { return !outline.detected; });
  std::ranges::stable_sort(outlines, std::greater(), [](const SeenOutline& outline) {
    return std::pair(outline.whole, outline.share);
  });
  std::vector<std::vector<std::int64_t>> frames(map.objects.size());
  for (const SeenOutline& outline : outlines) {
    if (frames[outline.object].size() < kFrames) {
      frames[outline.object].push_back(map.keyframes[outline.keyframe].frame_index);
    }
  }
  return frames;
}

void PrintJson(const QueryArguments& a, const MapSnapshot& map, const std::vector<QueryAnswer>& answers,
               const std::vector<std::vector<std::int64_t>>& frames) {
  nlohmann::ordered_json root = {{"question", a.question}, {"unit", FrameOf(map).Unit()}};
  root["answers"] = ToVector(answers, [&](const QueryAnswer& answer) {
    const auto i = static_cast<std::size_t>(answer.object);
    const SnapshotObject& object = map.objects[i];
    return nlohmann::ordered_json{{"id", object.id},
                                  {"label", object.label},
                                  {"probability", answer.probability},
                                  {"center", object.superquadric.T_map_object.translation},
                                  {"half_size", object.superquadric.shape.half_size},
                                  {"reliability", object.fit.reliability},
                                  {"frames", frames[i]}};
  });
  fmt::print("{}\n", JsonText(root));
}

void PrintTable(const MapSnapshot& map, const std::vector<QueryAnswer>& answers,
                const std::vector<std::vector<std::int64_t>>& frames) {
  if (answers.empty()) {
    fmt::print("no object of the map is an answer\n");
    return;
  }
  fmt::print("{:>4} {:<16} {:>11} {:<24} {:<22} {:>11}  {}\n", "id", "label", "probability",
             fmt::format("center, {}", UnitOf(map)), "size", "reliability", "best frames");
  for (const QueryAnswer& answer : answers) {
    const auto i = static_cast<std::size_t>(answer.object);
    const SnapshotObject& object = map.objects[i];
    fmt::print("{:>4} {:<16} {:>11.2f} {:<24} {:<22} {:>11.2f}  {}\n", object.id, ShownName(object),
               answer.probability,
               fmt::format("{:.3f}", fmt::join(object.superquadric.T_map_object.translation, " ")),
               fmt::format("{:.3f}", fmt::join(2.0 * object.superquadric.shape.half_size, " ")),
               object.fit.reliability, fmt::join(frames[i], " "));
  }
}

void Query(const QueryArguments& a) {
  const fs::path recording = MapFile(a.map);
  const RecordingReader reader = OpenMap(recording, a.objects, HiddenObjects::kLeaveOut);
  const MapSnapshotPtr last = reader.Last();
  ThrowIf<InputError>(last->objects.empty(), "{}: the map has no objects", recording.string());
  // In the order in which the page sees them.
  MapSnapshot map = *last;
  std::ranges::sort(map.keyframes, {}, &SnapshotKeyframe::timestamp);
  const std::vector<QueryAnswer> answers =
      AnswerQuery(a.question, map, SceneGraphOf(map, recording.parent_path()), ClassTable::Named("default"));
  const std::vector<std::vector<std::int64_t>> frames = BestFrames(reader, map);
  if (a.json) {
    PrintJson(a, map, answers, frames);
  } else {
    PrintTable(map, answers, frames);
  }
  if (!a.picture.empty()) {
    CreateFolderOf(a.picture);
    std::set<int> chosen;
    for (const QueryAnswer& answer : answers) {
      chosen.insert(answer.object);
    }
    DrawHighlighted(map, recording, chosen, a.style.Load(), a.backend, a.picture);
  }
}

}  // namespace

void AddQueryCommand(Command& program) {
  const auto [command, a] = program.AddCommand(
      "query", "Ask for objects of a map, such as \"cups on the table\"", kQueryNotes, Query);
  command.Group("Input");
  command.Positional("MAP", a.map, "map.sqmap, or the result folder that holds it").Required();
  command.Positional("QUESTION", a.question, "The question, in quotes").Required();
  AddObjectOptions(command, a.objects);
  command.Group("Output");
  command.Flag("--json", a.json, "Print the answers as JSON");
  command.Option("--picture FILE", a.picture,
                 "Also draw the map to FILE.png: answers with names, other objects as faint outlines");
  command.Group("Style");
  a.style.AddTo(command);
  AddBackendOption(command, a.backend);
}

}  // namespace sqslam::app
