#include "app/experiment/cells.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>

#include "slam/io/sequence.h"
#include "slam/util/error.h"
#include "slam/util/json_file.h"
#include "slam/util/largest.h"
#include "slam/util/markup.h"
#include "slam/util/text_lines.h"

namespace sqslam::app {
namespace fs = std::filesystem;
using Words = std::vector<std::string>;
namespace {

// Returns name, size and time of modification: enough to notice that an image or a video is another one.
std::string StateOf(const fs::path& file) {
  std::error_code missing;
  const auto time = fs::last_write_time(file, missing).time_since_epoch().count();
  return fmt::format("{} {} {}\n", file.string(), fs::file_size(file, missing), time);
}

// Returns what is in a file, or the states of the files in a folder of boxes; "" if it cannot be read: the
// program that needs it will report that.
std::string Contents(const fs::path& path) {
  if (std::error_code missing; fs::is_directory(path, missing)) {
    const std::set<fs::path> files(fs::directory_iterator(path), {});  // sorted
    std::string states;
    std::ranges::for_each(files, [&](const fs::path& file) { states += StateOf(file); });
    return states;
  }
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Returns the states of the images, or of the video; "" if there are none.
std::string ImagesOf(const fs::path& path, const std::string& format) {
  if (std::error_code missing; !fs::is_directory(path, missing)) {
    return StateOf(path);
  }
  SequenceRequest request{.path = path, .known_camera = Camera()};  // looks at neither calibration nor boxes
  request.format = FromName<SequenceFormat>(format).value_or(SequenceFormat::kAuto);
  std::string states;
  try {
    for (const SequenceFrame& frame : OpenSequence(request).frames) {
      states += StateOf(frame.image_path);
    }
  } catch (const std::exception&) {  // the run will report it
  }
  return states;
}

std::string NameOfCell(const ExperimentCell& cell) {
  std::string name =
      fmt::format("{}-{}-{}-{}", cell.sequence, cell.representation, cell.association, cell.method);
  if (!cell.variant.empty()) {
    name += fmt::format("-{}", cell.variant);
  }
  if (cell.max_objects != kAllObjects) {
    name += fmt::format("-objects{}", cell.max_objects);
  }
  return name + fmt::format("-{}", cell.repetition);
}

void AddCells(const ExperimentGrid& grid, int repetition, std::set<std::string>& seen,
              std::vector<ExperimentCell>& cells) {
  for (const std::string& sequence : grid.sequences) {
    for (const std::string& representation : grid.representations) {
      for (const std::string& association : grid.associations) {
        for (const std::string& method : grid.methods) {
          for (const std::string& variant : grid.variants) {
            for (const std::string& limit : grid.max_objects) {
              ExperimentCell cell{.name = "",
                                  .sequence = sequence,
                                  .representation = representation,
                                  .association = association,
                                  .method = method,
                                  .variant = variant == "default" ? "" : variant,
                                  .max_objects = *ObjectLimit(limit),
                                  .repetition = repetition};
              cell.name = NameOfCell(cell);
              if (seen.insert(cell.name).second) {
                cells.push_back(std::move(cell));
              }
            }
          }
        }
      }
    }
  }
}

const ExperimentSequence& SequenceOf(const ExperimentConfig& config, const std::string& name) {
  return *std::ranges::find(config.sequences, name, &ExperimentSequence::name);
}

void AddSet(const Words& assignments, Words& arguments) {
  for (const std::string& assignment : assignments) {
    arguments.insert(arguments.end(), {"--set", assignment});
  }
}

void AddIf(bool wanted, const std::string& option, const std::string& value, Words& arguments) {
  if (wanted) {
    arguments.insert(arguments.end(), {option, value});
  }
}

// Resolves detections against the sequence folder, or else like any other path of the configuration.
fs::path DetectionsOf(const ExperimentConfig& config, const ExperimentSequence& sequence,
                      const fs::path& path) {
  const fs::path beside = path / sequence.detections;  // unchanged if absolute
  if (sequence.detections.empty() || beside == sequence.detections) {
    return sequence.detections;
  }
  return !sequence.scene.empty() || fs::exists(beside) ? beside : ResolvePath(config, sequence.detections);
}

using json = nlohmann::ordered_json;

void ReadScores(const json& eval, CellResult& result) {
  if (!eval.contains("objects")) {
    return;  // no ground truth of objects
  }
  const json& summary = eval.at("summary");
  result.has_objects = true;
  result.has_scored = summary.contains("scored");
  result.mapped = summary.at("mapped").get<int>();
  result.duplicates = summary.at("duplicates").get<int>();
  result.extra = summary.at("extra").get<int>();
  for (const json& count : summary.at("coverage")) {
    if (count.at("min_detections").get<int>() == 60) {
      result.found_60 = count.at("mapped").get<int>();
      result.total_60 = count.at("total").get<int>();
    }
  }
  result.objects = ScoresIn(eval);
}

}  // namespace

std::vector<ExperimentCell> ListCells(const ExperimentConfig& config) {
  const int repetitions = Largest(config.grids, 0, &ExperimentGrid::repetitions);
  std::vector<ExperimentCell> cells;
  std::set<std::string> seen;
  for (int repetition = 1; repetition <= repetitions; ++repetition) {
    for (const ExperimentGrid& grid : config.grids) {
      if (repetition <= grid.repetitions) {
        AddCells(grid, repetition, seen, cells);
      }
    }
  }
  return cells;
}

PreparedSequence Prepare(const ExperimentConfig& config, const ExperimentSequence& sequence,
                         const ExperimentFolder& folder) {
  PreparedSequence prepared;
  const std::string camera = Contents(ResolvePath(config, sequence.camera));
  if (sequence.scene.empty()) {
    prepared.path = fs::weakly_canonical(ResolvePath(config, sequence.path));
    prepared.detections = DetectionsOf(config, sequence, prepared.path);
    std::string all = camera + Contents(prepared.detections) + ImagesOf(prepared.path, sequence.format);
    for (const char* name : {"boxes.txt", "camera.yaml", "rgb.txt", "groundtruth.txt", "objects_gt.json"}) {
      all += Contents(prepared.path / name);
    }
    prepared.inputs = Fingerprint(all);
    return prepared;
  }
  const fs::path scene = ResolvePath(config, sequence.scene);
  Words rendering = {"synth", scene.string(), "--quiet"};
  const FrameRange range = FramesOf(sequence);
  if (range.count < std::numeric_limits<std::int64_t>::max()) {
    AddIf(true, "--frames", std::to_string(range.start + range.count * range.stride), rendering);
  }
  // The name contains a hash of all that the images depend on, so that a stale folder is never used.
  std::string all = ReadFile(scene, "a scene description (YAML)");
  for (std::size_t i = 2; i < rendering.size(); ++i) {
    all.append("\n").append(rendering[i]);
  }
  prepared.inputs = Fingerprint(all);
  prepared.path = folder.Rendered(fmt::format("{}-{}", scene.stem().string(), prepared.inputs.substr(0, 8)));
  prepared.detections = DetectionsOf(config, sequence, prepared.path);
  const bool own_boxes = prepared.detections == sequence.detections;  // not rendered with the images
  prepared.inputs = Fingerprint(all + camera + (own_boxes ? Contents(prepared.detections) : ""));
  rendering.insert(rendering.end(), {"--output", prepared.path.string()});
  prepared.rendering = std::move(rendering);
  return prepared;
}

CellCommands CommandsOf(const ExperimentConfig& config, const PreparedSequence& prepared,
                        const ExperimentCell& cell, const ExperimentFolder& folder) {
  const ExperimentSequence& sequence = SequenceOf(config, cell.sequence);
  const auto variant = std::ranges::find(config.variants, cell.variant, &ExperimentVariant::name);
  const std::string result = folder.Run(cell).string();
  const bool limited = cell.max_objects != kAllObjects;
  Words run = {"run", prepared.path.string(), "--output", result, "--no-render", "--quiet"};
  AddIf(!sequence.format.empty(), "--format", sequence.format, run);
  AddIf(!sequence.camera.empty(), "--camera", ResolvePath(config, sequence.camera).string(), run);
  AddIf(limited || !prepared.detections.empty(), "--detections",
        limited ? folder.Boxes(cell).string() : prepared.detections.string(), run);
  AddIf(sequence.start > 0, "--start", std::to_string(sequence.start), run);
  AddIf(!sequence.frames.empty(), "--frames", sequence.frames, run);
  AddIf(sequence.stride > 1, "--stride", std::to_string(sequence.stride), run);
  AddIf(!config.options.empty(), "--config", ResolvePath(config, config.options).string(), run);
  if (config.deterministic) {
    run.emplace_back("--deterministic");
  }
  AddIf(true, "--seed", std::to_string(config.seed + cell.repetition - 1), run);
  AddIf(true, "--representation", cell.representation, run);
  AddSet({"objects.association.method=" + cell.association, "objects.method=" + cell.method}, run);
  AddSet(sequence.set, run);
  AddSet(variant->set, run);
  CellCommands commands{std::move(run), {}};
  if (sequence.evaluate) {
    commands.eval = {"eval", result, "--ground-truth", prepared.path.string(), "--quiet"};
  }
  return commands;
}

nlohmann::ordered_json SettingsOf(const ExperimentConfig& config, const PreparedSequence& sequence,
                                  const CellCommands& commands, const ExperimentFolder& folder) {
  const std::string root = folder.path.string();
  const auto movable = [&](Words words) {
    for (std::string& word : words) {
      word = word.starts_with(root + "/") ? fmt::format(".{}", word.substr(root.size())) : word;
    }
    return words;
  };
  return {
      {"run", movable(commands.run)},
      {"eval", movable(commands.eval)},
      {"options", config.options.empty() ? "" : Fingerprint(Contents(ResolvePath(config, config.options)))},
      {"inputs", sequence.inputs}};
}

fs::path ExperimentFolder::Boxes(const ExperimentCell& cell) const {
  return path / "boxes" / fmt::format("{}+{}.txt", cell.sequence, cell.max_objects);
}

void WriteCellRecord(const fs::path& run, const nlohmann::ordered_json& settings, int jobs,
                     const std::string& program) {
  const nlohmann::ordered_json record = {{"format", "sqslam-cell"},
                                         {"version", 1},
                                         {"jobs", jobs},
                                         {"program", program},
                                         {"settings", settings}};
  WriteJsonFile(run / "cell.json", record);
}

std::optional<CellResult> ReadCellResult(const fs::path& run, const ExperimentCell& cell,
                                         const nlohmann::ordered_json& settings) {
  if (!fs::exists(run / "cell.json")) {
    return std::nullopt;
  }
  try {
    const auto record = ReadJsonFile(run / "cell.json", "the record of a cell");
    if (record.at("settings") != settings) {
      return std::nullopt;
    }
    CellResult result;
    result.cell = cell;
    result.jobs = record.at("jobs").get<int>();
    result.program = record.at("program").get<std::string>();
    result.stats = ReadStats(run / "stats.json");
    if (!settings.at("eval").empty()) {
      ReadScores(ReadJsonFile(run / "eval.json", "an evaluation"), result);
    }
    return result;
  } catch (const InputError&) {  // missing or broken files
  } catch (const json::exception&) {
  }
  return std::nullopt;
}

std::string ProgramFingerprint() {
  static const std::string fingerprint = Fingerprint(Contents("/proc/self/exe"));
  return fingerprint;
}

}  // namespace sqslam::app
