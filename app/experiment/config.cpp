#include "app/experiment/config.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>

#include "slam/system_options.h"
#include "slam/util/data_path.h"
#include "slam/util/error.h"
#include "slam/util/options.h"
#include "slam/util/text_lines.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {
namespace fs = std::filesystem;
using Words = std::vector<std::string>;
namespace {

// A YAML map whose keys are the fields of a struct.
class Group {
 public:
  Group(YAML::Node node, std::string source, std::string name)
      : node_(std::move(node)), source_(std::move(source)), name_(std::move(name)) {
    if (!node_.IsMap()) {
      Fail("", name_ + ": expected lines 'name: value'");
    }
  }

  // Reads all keys but `lists`, which hold groups.
  void Read(auto&& fields, const Words& lists = {}) const {
    AssignOptions(node_, source_, OptionFields(fields), lists);
  }

  std::vector<Group> Groups(const std::string& key) const {  // empty if the key is missing
    std::vector<Group> groups;
    if (const YAML::Node list = node_[key]) {
      if (!list.IsSequence() || list.size() == 0) {
        Fail(key, key + ": expected a list of groups that each begin with '-'");
      }
      for (const YAML::Node& node : list) {
        groups.emplace_back(node, source_, "an entry of " + key);
      }
    }
    return groups;
  }

  // Throws UsageError "FILE:LINE: PROBLEM" with the line of the key, or of the group if the key is missing.
  [[noreturn]] void Fail(const std::string& key, const std::string& problem) const {
    int line = node_.Mark().line;
    for (const auto& entry : node_.IsMap() ? node_ : YAML::Node()) {  // entries of a list have no name
      line = entry.first.IsScalar() && entry.first.Scalar() == key ? entry.first.Mark().line : line;
    }
    throw UsageError("{}:{}: {}", source_, line + 1, problem);
  }
  [[noreturn]] void FailWithout(const std::string& key, const std::string& expected) const {
    Fail("", fmt::format("{} without '{}', expected {}", name_, key, expected));
  }
  // Runs `action`; a UsageError is rethrown with the line of the key.
  void Try(const std::string& key, auto action) const {
    try {
      action();
    } catch (const UsageError& error) {
      Fail(key, error.what());
    }
  }

  // Checks that all words are among `allowed`; a single `all` stands for all of them.
  void CheckWords(const std::string& key, const Words& allowed, Words& words) const {
    words = words == Words{"all"} ? allowed : words;
    for (const std::string& word : words) {
      if (std::ranges::find(allowed, word) == allowed.end()) {
        Fail(key, fmt::format("{} holds '{}', expected {}{}", key, word, fmt::join(allowed, ", "),
                              DidYouMean(word, allowed)));
      }
    }
    if (words.empty()) {
      Fail(key, key + " is an empty list, expected a list [..] of words");
    }
  }

 private:
  YAML::Node node_;
  std::string source_;
  std::string name_;  // in messages: "the experiment", "an entry of grids"
};

void CheckAxes(const Group& group, ExperimentGrid& grid) {
  group.CheckWords("representations", AllNames<Representation>(), grid.representations);
  group.CheckWords("associations", AllNames<AssociationMethod>(), grid.associations);
  group.CheckWords("methods", AllNames<ObjectMethod>(), grid.methods);
  if (grid.max_objects.empty()) {
    group.Fail("max_objects", "max_objects is an empty list, expected numbers or all");
  }
  for (const std::string& word : grid.max_objects) {
    if (!ObjectLimit(word)) {
      group.Fail("max_objects",
                 fmt::format("max_objects holds '{}', expected whole numbers of at least 0, or all", word));
    }
  }
}

// Checks options key=value, so that a misspelled one is found before the first run.
void CheckSet(const Group& group, const Words& set) {
  SystemOptions options;
  for (const std::string& assignment : set) {
    group.Try("set", [&] { SetOption(assignment, options); });
  }
}

// Checks that a name is unique and can be part of a folder name.
void CheckName(const Group& group, const std::string& name, const Words& taken) {
  const auto is_plain = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
  };
  if (name.empty() || name.front() == '.' || !std::ranges::all_of(name, is_plain)) {
    group.Fail("name", fmt::format("name is '{}', expected letters, digits, '_', '-' and '.'", name));
  }
  if (std::ranges::find(taken, name) != taken.end()) {
    group.Fail("name", fmt::format("the name '{}' is taken, expected another one in 'name'", name));
  }
}

template <typename Item>
Words NamesOf(const std::vector<Item>& items) {
  return ToVector(items, &Item::name);
}

// Returns the names of the variants as in a configuration: the unnamed one is `default`.
Words VariantWords(const ExperimentConfig& config) {
  Words names = NamesOf(config.variants);
  names.front() = "default";
  return names;
}

ExperimentSequence ReadSequence(const Group& group, const Words& taken) {
  ExperimentSequence sequence;
  group.Read(sequence);
  if (sequence.path.empty() == sequence.scene.empty()) {
    group.FailWithout(sequence.path.empty() ? "path" : "only one of path and scene",
                      "path: a sequence folder, or scene: a scene to render");
  }
  const fs::path source = sequence.path.empty() ? sequence.scene : sequence.path;
  const fs::path named = source.has_filename() ? source : source.parent_path();
  sequence.name = sequence.name.empty() ? named.stem().string() : sequence.name;
  CheckName(group, sequence.name, taken);
  group.Try("frames", [&] { FramesOf(sequence); });
  CheckSet(group, sequence.set);
  return sequence;
}

void ReadGrids(const Group& root, ExperimentConfig& config) {
  for (const Group& group : root.Groups("grids")) {
    ExperimentGrid grid = config.common;
    grid.variants = {"default"};
    group.Read(grid);
    CheckAxes(group, grid);
    group.CheckWords("sequences", NamesOf(config.sequences), grid.sequences);
    group.CheckWords("variants", VariantWords(config), grid.variants);
    config.grids.push_back(std::move(grid));
  }
  if (config.grids.empty()) {
    config.grids = {config.common};
  }
}

}  // namespace

std::optional<int> ObjectLimit(const std::string& word) {
  const std::optional<int> limit = word == "all" ? kAllObjects : ParseNumber<int>(word);
  return limit && (*limit >= 0 || word == "all") ? limit : std::nullopt;
}

FrameRange FramesOf(const ExperimentSequence& sequence) {
  return ParseFrameRange(sequence.frames, sequence.start > 0 ? std::optional(sequence.start) : std::nullopt,
                         sequence.stride);
}

ExperimentConfig ParseExperiment(const std::string& yaml, const std::string& source) {
  YAML::Node document;
  try {
    document = YAML::Load(yaml);
  } catch (const YAML::ParserException& e) {
    throw UsageError("{}:{}: invalid YAML: {}", source, e.mark.line + 1, e.msg);
  }
  const Group root(document, source, "the experiment");
  const SystemOptions defaults;
  ExperimentConfig config;
  config.folder = fs::path(source).parent_path();
  config.output = (fs::path("out") / fs::path(source).stem()).string();
  config.variants = {{}};
  config.common.representations = {NameOf(defaults.objects.representation)};
  config.common.associations = {NameOf(defaults.objects.association.method)};
  config.common.methods = {NameOf(defaults.objects.method)};
  root.Read(config, {"sequences", "variants", "grids"});
  CheckAxes(root, config.common);
  for (const Group& group : root.Groups("sequences")) {
    config.sequences.push_back(ReadSequence(group, NamesOf(config.sequences)));
  }
  if (config.sequences.empty()) {
    root.FailWithout("sequences", "a list of sequences, each with a path or a scene");
  }
  for (const Group& group : root.Groups("variants")) {
    ExperimentVariant variant;
    group.Read(variant);
    CheckName(group, variant.name, VariantWords(config));
    CheckSet(group, variant.set);
    config.variants.push_back(std::move(variant));
  }
  config.common.sequences = NamesOf(config.sequences);
  config.common.variants = VariantWords(config);
  ReadGrids(root, config);
  return config;
}

ExperimentConfig ReadExperiment(const fs::path& path) {
  try {
    return ParseExperiment(ReadFile(path, "the description of an experiment (YAML)"), path.string());
  } catch (const InputError& error) {
    throw UsageError(error.what());
  }
}

fs::path ResolvePath(const ExperimentConfig& config, const fs::path& path) {
  if (path.string().starts_with('-')) {  // must not be taken for an option
    return ResolvePath(config, "." / path);
  }
  if (path.empty() || path.is_absolute() || fs::exists(path)) {
    return path;
  }
  if (fs::exists(config.folder / path)) {
    return config.folder / path;
  }
  try {
    return DataPath(path);
  } catch (const InputError&) {
    return path;  // the run will report it as missing
  }
}

}  // namespace sqslam::app
