#include "app/experiment/experiment_config.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <fstream>
#include <sstream>

#include "app/experiment/experiment_yaml.h"
#include "slam/system_options.h"
#include "slam/util/data_path.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

using Words = std::vector<std::string>;

void CheckWord(const std::string& where, const std::string& key, const std::string& word,
               const Words& allowed) {
  if (std::find(allowed.begin(), allowed.end(), word) == allowed.end()) {
    const std::string nearest = NearestWord(word, allowed);
    throw UsageError(fmt::format("{}: {} holds '{}', expected {}{}", where, key, word,
                                 fmt::join(allowed, ", "),
                                 nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest)));
  }
}

// A list of allowed words, or `all` for all of them; what `value` holds where the key is missing.
void ReadWords(YamlGroup& group, const std::string& key, const Words& allowed, Words& value) {
  const auto words = group.Texts(key);
  if (!words) {
    return;
  }
  if (*words == Words{"all"}) {
    value = allowed;
    return;
  }
  for (const std::string& word : *words) {
    CheckWord(group.Where(key), key, word, allowed);
  }
  value = *words;
}

// Numbers of objects; `all` for no limit.
void ReadLimits(YamlGroup& group, std::vector<int>& value) {
  const auto words = group.Texts("max_objects");
  if (!words) {
    return;
  }
  value.clear();
  for (const std::string& word : *words) {
    int limit = kAllObjects;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), limit);
    const bool is_number = error == std::errc() && end == word.data() + word.size() && limit >= 0;
    if (word != "all" && !is_number) {
      throw UsageError(fmt::format("{}: max_objects holds '{}', expected whole numbers of at least 0, or all",
                                   group.Where("max_objects"), word));
    }
    value.push_back(limit);
  }
}

// Options in a list of key=value, tried out so that a misspelled one is found before the first run.
Words ReadSet(YamlGroup& group) {
  const Words assignments = group.Texts("set").value_or(Words{});
  SystemOptions options;
  for (const std::string& assignment : assignments) {
    try {
      SetOption(assignment, options);
    } catch (const UsageError& error) {
      throw UsageError(fmt::format("{}: {}", group.Where("set"), error.what()));
    }
  }
  return assignments;
}

// Names become folder names.
std::string ReadName(YamlGroup& group, const std::string& fallback, const Words& taken) {
  const std::string name = group.Text("name").value_or(fallback);
  const auto is_plain = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
  };
  if (name.empty() || name.front() == '.' || !std::all_of(name.begin(), name.end(), is_plain)) {
    throw UsageError(fmt::format("{}: name is '{}', expected letters, digits, '_', '-' and '.'",
                                 group.Where("name"), name));
  }
  if (std::find(taken.begin(), taken.end(), name) != taken.end()) {
    throw UsageError(
        fmt::format("{}: the name '{}' is taken, expected another one in 'name'", group.Where("name"), name));
  }
  return name;
}

template <typename Item>
Words NamesOf(const std::vector<Item>& items) {
  Words names;
  std::transform(items.begin(), items.end(), std::back_inserter(names),
                 [](const auto& item) { return item.name; });
  return names;
}

ExperimentSequence ReadSequence(YamlGroup& group, const Words& taken) {
  ExperimentSequence sequence;
  sequence.path = group.Text("path").value_or("");
  sequence.scene = group.Text("scene").value_or("");
  if (sequence.path.empty() == sequence.scene.empty()) {
    group.ThrowMissing(sequence.path.empty() ? "path" : "only one of path and scene",
                       "path: a sequence folder, or scene: a scene to render");
  }
  const fs::path source = sequence.path.empty() ? sequence.scene : sequence.path;
  const fs::path named = source.has_filename() ? source : source.parent_path();
  sequence.name = ReadName(group, named.stem().string(), taken);
  sequence.format = group.Text("format").value_or("");
  sequence.camera = group.Text("camera").value_or("");
  sequence.detections = group.Text("detections").value_or("");
  sequence.evaluate = group.Flag("evaluate").value_or(true);
  sequence.start = group.Whole("start", 0).value_or(0);
  sequence.frames = group.Whole("frames", 1).value_or(0);
  sequence.stride = group.Whole("stride", 1).value_or(1);
  sequence.set = ReadSet(group);
  group.CheckKeys();
  return sequence;
}

// The axes of a grid; those that are missing stay as in `grid`.
void ReadAxes(YamlGroup& group, const ExperimentConfig& config, bool with_names, ExperimentGrid& grid) {
  ReadWords(group, "representations", AllNames<Representation>(), grid.representations);
  ReadWords(group, "associations", AllNames<AssociationMethod>(), grid.associations);
  ReadWords(group, "methods", AllNames<ObjectMethod>(), grid.methods);
  ReadLimits(group, grid.max_objects);
  grid.repetitions = static_cast<int>(group.Whole("repetitions", 1).value_or(grid.repetitions));
  if (with_names) {  // at the top these keys hold what the names mean
    ReadWords(group, "sequences", NamesOf(config.sequences), grid.sequences);
    Words variants = NamesOf(config.variants);
    variants.front() = "default";
    ReadWords(group, "variants", variants, grid.variants);
    std::replace(grid.variants.begin(), grid.variants.end(), std::string("default"), std::string());
  }
}

void ReadSequences(YamlGroup& root, ExperimentConfig& config) {
  for (YamlGroup& group : root.Groups("sequences")) {
    config.sequences.push_back(ReadSequence(group, NamesOf(config.sequences)));
  }
  if (config.sequences.empty()) {
    root.ThrowMissing("sequences", "a list of sequences, each with a path or a scene");
  }
}

void ReadVariants(YamlGroup& root, ExperimentConfig& config) {
  config.variants = {{}};
  for (YamlGroup& group : root.Groups("variants")) {
    Words taken = NamesOf(config.variants);
    taken.front() = "default";
    ExperimentVariant variant{ReadName(group, "", taken), ReadSet(group)};
    group.CheckKeys();
    config.variants.push_back(std::move(variant));
  }
}

}  // namespace

ExperimentConfig ParseExperiment(const std::string& yaml, const std::string& source) {
  YAML::Node document;
  try {
    document = YAML::Load(yaml);
  } catch (const YAML::ParserException& e) {
    throw UsageError(fmt::format("{}:{}: no valid YAML: {}", source, e.mark.line + 1, e.msg));
  }
  YamlGroup root(document, source, "the experiment");
  ExperimentConfig config;
  config.folder = fs::path(source).parent_path();
  config.output = root.Text("output").value_or((fs::path("out") / fs::path(source).stem()).string());
  config.options = root.Text("config").value_or("");
  config.deterministic = root.Flag("deterministic").value_or(false);
  config.seed = root.Whole("seed", 0).value_or(1);
  config.jobs = static_cast<int>(root.Whole("jobs", 1).value_or(1));
  config.objects = root.Texts("objects").value_or(Words{});
  ReadSequences(root, config);
  ReadVariants(root, config);

  const SystemOptions defaults;
  ExperimentGrid grid;
  grid.sequences = NamesOf(config.sequences);
  grid.representations = {NameOf(defaults.objects.representation)};
  grid.associations = {NameOf(defaults.objects.association.method)};
  grid.methods = {NameOf(defaults.objects.method)};
  grid.variants = NamesOf(config.variants);
  grid.max_objects = {kAllObjects};
  ReadAxes(root, config, false, grid);
  for (YamlGroup& group : root.Groups("grids")) {
    config.grids.push_back(grid);
    config.grids.back().variants = {""};
    ReadAxes(group, config, true, config.grids.back());
    group.CheckKeys();
  }
  root.CheckKeys();
  if (config.grids.empty()) {
    config.grids = {grid};
  }
  return config;
}

ExperimentConfig ReadExperiment(const fs::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) {
    throw UsageError(
        fmt::format("{}: cannot be read, expected the description of an experiment (YAML)", path.string()));
  }
  return ParseExperiment(text.str(), path.string());
}

fs::path ResolvePath(const ExperimentConfig& config, const fs::path& path) {
  if (path.empty() || path.is_absolute() || fs::exists(path)) {
    return path;
  }
  if (fs::exists(config.folder / path)) {
    return config.folder / path;
  }
  try {
    return DataPath(path);
  } catch (const InputError&) {
    return path;  // the run that needs it will say that it is missing
  }
}

}  // namespace sqslam::app
