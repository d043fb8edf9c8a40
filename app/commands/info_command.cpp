#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>
#include <vector>

#include "app/commands/commands.h"
#include "app/result/map_input.h"
#include "slam/geometry/angles.h"
#include "slam/recognition/vocabulary.h"
#include "slam/snapshot/recording.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace {

constexpr const char* kInfoNotes = R"(
Examples:
  sqslam info out/kitchen/map.sqmap
  sqslam info out/kitchen --config > again.yaml
  sqslam info out/kitchen --history
  sqslam info out/kitchen --edits auto
  sqslam info assets/vocabulary.bin
)";

void PrintObjects(const MapSnapshot& snapshot) {
  if (snapshot.objects.empty()) {
    return;
  }
  fmt::print("{:>4} {:<16} {:>5} {:>5} {:>6}  {:<24} {:<22} {:>5} {:>5} {:>7}\n", "id", "label", "score",
             "seen", "points", "center", "half size", "e1", "e2", "yaw");
  for (const SnapshotObject& object : snapshot.objects) {
    const Superquadric& shape = object.superquadric.shape;
    fmt::print("{:>4} {:<16} {:>5.2f} {:>5} {:>6}  {:<24} {:<22} {:>5.2f} {:>5.2f} {:>5.0f}\u00b0\n",
               object.id, ShownName(object), object.score, object.observations, object.points,
               fmt::format("{:.3f}", fmt::join(object.superquadric.T_map_object.translation, " ")),
               fmt::format("{:.3f}", fmt::join(shape.half_size, " ")), shape.e1, shape.e2,
               object.yaw * kDegreesPerRadian);
  }
}

void PrintVocabulary(const std::filesystem::path& path) {
  const Vocabulary vocabulary = Vocabulary::Load(path);
  fmt::print(
      "vocabulary {}\nwords      {}\nnodes      {}\nlevels     {}\nlearned    from {} features of {} "
      "images\n",
      path.string(), vocabulary.Words(), vocabulary.Nodes(), vocabulary.Depth(),
      vocabulary.TrainedDescriptors(), vocabulary.TrainedImages());
}

// Prints the growth of the map: one line for each snapshot of the recording.
void PrintHistory(const RecordingReader& reader) {
  fmt::print("{:>8} {:>10} {:>9} {:>9} {:>7} {:>8}\n", "frame", "time", "keyframes", "points", "objects",
             "tracking");
  for (int i = 0; i < reader.Size(); ++i) {
    const MapSnapshotPtr snapshot = reader.Read(i);
    fmt::print("{:>8} {:>10.3f} {:>9} {:>9} {:>7} {:>8}\n", snapshot->frame_index, snapshot->timestamp,
               snapshot->keyframes.size(), snapshot->points.size(), snapshot->objects.size(),
               snapshot->T_map_camera ? "yes" : "no");
  }
}

// Prints the changes by the edits; if edits exist but are not applied, only their file.
void PrintEdits(const std::filesystem::path& path, const std::string& edits) {
  const std::filesystem::path file = EditsFile(path, edits);
  if (file.empty()) {
    if (std::filesystem::exists(EditsFileOf(path))) {
      fmt::print("edits      {}, not applied (--edits auto)\n", EditsFileOf(path).string());
    }
    return;
  }
  const ObjectEdits read = ReadObjectEdits(file);
  std::vector<std::string> hidden, deleted, merged;
  for (const auto& [id, edit] : read.All()) {
    if (edit.merged_into) {
      merged.push_back(fmt::format("{} into {}", id, read.KeptIdOf(id)));
    } else if (edit.deleted) {
      deleted.push_back(std::to_string(id));
    } else if (edit.hidden) {
      hidden.push_back(std::to_string(id));
    }
  }
  fmt::print("edits      {}\n", file.string());
  for (const auto& [what, ids] : {std::pair("hidden", hidden), {"deleted", deleted}, {"merged", merged}}) {
    if (!ids.empty()) {
      fmt::print("{:<10} {}\n", what, fmt::join(ids, ", "));
    }
  }
}

struct InfoArguments {
  std::string map;
  bool config = false;
  bool history = false;
  ObjectArguments objects;
};

void PrintInfo(const InfoArguments& a) {
  ThrowIf<UsageError>(a.config && a.history, "--config and --history: expected one of them");
  const std::filesystem::path path = MapFile(a.map);
  if (Vocabulary::IsVocabularyFile(path)) {
    PrintVocabulary(path);
    return;
  }
  const RecordingReader reader = OpenMap(path, a.objects, HiddenObjects::kKeep);
  if (a.config) {
    fmt::print("{}", reader.Info().config);
    return;
  }
  if (a.history) {
    PrintHistory(reader);
    return;
  }
  fmt::print("map        {}\nsequence   {}\nwritten by sqslam {}\nsnapshots  {}\n", path.string(),
             reader.Info().sequence_path.empty() ? "images of two inputs"
                                                 : ReplaceControls(reader.Info().sequence_path),
             reader.Info().program_version, reader.Size());
  fmt::print("lengths    {}\n",
             reader.Info().scale ? "metres: " + ScaleText(*reader.Info().scale) : "map units (sqslam scale)");
  PrintEdits(path, a.objects.edits);
  if (reader.Size() == 0) {
    return;
  }
  const MapSnapshotPtr last = reader.Last();
  fmt::print("frames     {} to {}, the last at {:.3f} s\nkeyframes  {}\npoints     {}\n",
             reader.FrameIndex(0), last->frame_index, last->timestamp, last->keyframes.size(),
             last->points.size());
  fmt::print("camera     {}x{}, fx {:.1f}, fy {:.1f}\nup         {}\nobjects    {}\n", last->camera.width,
             last->camera.height, last->camera.fx, last->camera.fy,
             last->gravity_known ? "known" : "not known", last->objects.size());
  PrintObjects(*last);
}

}  // namespace

void AddInfoCommand(Command& program) {
  const auto [command, a] =
      program.AddCommand("info", "List the contents of a map or a vocabulary", kInfoNotes, PrintInfo);
  command.Group("Input");
  command.Positional("MAP", a.map, "map.sqmap, the result folder that holds it, or a vocabulary").Required();
  AddObjectOptions(command, a.objects);
  command.Group("Output");
  command.Flag("--config", a.config, "Print the options of the run as YAML");
  command.Flag("--history", a.history, "Print one line per snapshot, to show how the map grew");
}

}  // namespace sqslam::app
