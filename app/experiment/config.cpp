#include "app/experiment/config.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <charconv>

#include "slam/system_options.h"
#include "slam/util/data_path.h"
#include "slam/util/error.h"
#include "slam/util/options.h"
#include "slam/util/text_lines.h"

namespace sqslam::app {
namespace fs = std::filesystem;
using Words = std::vector<std::string>;
namespace {

// A YAML map read key by key: a value stays as it is where its key is missing. What is there but of the wrong
// kind ends with a UsageError that names file and line, what stands there and what was expected.
class YamlGroup {
 public:
  YamlGroup(YAML::Node node, std::string source, std::string name)
      : node_(std::move(node)), source_(std::move(source)), name_(std::move(name)) {
    if (!node_.IsMap()) {
      throw UsageError(
          fmt::format("{}: {} is {}, expected lines 'name: value'", Where(), name_, Shown(node_)));
    }
  }

  void Read(const std::string& key, std::string& text) {
    const YAML::Node node = Find(key);
    if (node.IsDefined() && (!node.IsScalar() || node.Scalar().empty())) {
      Fail(key, node, "one word");
    }
    text = node.IsDefined() ? node.Scalar() : text;
  }
  void Read(const std::string& key, fs::path& path) {
    std::string text = path.string();
    Read(key, text);
    path = text;
  }
  void Read(const std::string& key, bool& flag) {
    const YAML::Node node = Find(key);
    if (node.IsDefined() && !YAML::convert<bool>::decode(node, flag)) {
      Fail(key, node, "true or false");
    }
  }
  template <typename Whole>
  void Read(const std::string& key, Whole& number, std::type_identity_t<Whole> min) {
    const YAML::Node node = Find(key);
    if (node.IsDefined() && (!YAML::convert<Whole>::decode(node, number) || number < min)) {
      Fail(key, node, fmt::format("a whole number of at least {}", min));
    }
  }
  // A list, or one word instead of a list of one; never empty where the key is there.
  bool Read(const std::string& key, Words& words) {
    const YAML::Node node = Find(key);
    if (!node.IsDefined()) {
      return false;
    }
    words = node.IsScalar() ? Words{node.Scalar()} : Words{};
    for (std::size_t i = 0; node.IsSequence() && i < node.size(); ++i) {
      words.push_back(node[i].IsScalar() ? node[i].Scalar() : Fail(key, node[i], "a list [..] of words"));
    }
    if (words.empty()) {
      Fail(key, node, "a list [..] of words");
    }
    return true;
  }
  // A list of words that are all among `allowed`, or `all` for those.
  void Read(const std::string& key, const Words& allowed, Words& words) {
    Words read;
    if (!Read(key, read)) {
      return;
    }
    for (const std::string& word : read) {
      if (read != Words{"all"} && std::find(allowed.begin(), allowed.end(), word) == allowed.end()) {
        throw UsageError(fmt::format("{}: {} holds '{}', expected {}{}", Where(key), key, word,
                                     fmt::join(allowed, ", "), DidYouMean(word, allowed)));
      }
    }
    words = read == Words{"all"} ? allowed : read;
  }
  std::vector<YamlGroup> Groups(const std::string& key) {  // empty where the key is missing
    const YAML::Node node = Find(key);
    if (node.IsDefined() && (!node.IsSequence() || node.size() == 0)) {
      Fail(key, node, "a list of groups that each begin with '-'");
    }
    std::vector<YamlGroup> groups;
    for (std::size_t i = 0; node.IsDefined() && i < node.size(); ++i) {
      groups.emplace_back(node[i], source_, "an entry of " + key);
    }
    return groups;
  }

  void CheckKeys() const {  // once all known keys have been read
    for (const auto& entry : node_) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
      if (std::find(known_.begin(), known_.end(), key) == known_.end()) {
        throw UsageError(fmt::format("{}: unknown key '{}'{}", Where(key), key, DidYouMean(key, known_)));
      }
    }
  }

  // "FILE:LINE" of the key, of the group where it is missing.
  std::string Where(const std::string& key = "") const {
    int line = node_.Mark().line;
    for (const auto& entry : node_) {
      if (entry.first.IsScalar() && entry.first.Scalar() == key) {
        line = entry.first.Mark().line;
      }
    }
    return fmt::format("{}:{}", source_, line + 1);
  }
  [[noreturn]] void ThrowMissing(const std::string& key, const std::string& expected) const {
    throw UsageError(fmt::format("{}: {} without '{}', expected {}", Where(), name_, key, expected));
  }

 private:
  YAML::Node Find(const std::string& key) {  // remembers that the key is known
    known_.push_back(key);
    const YAML::Node& node = node_;  // looking a key up in a changeable node would insert it
    return node[key] ? node[key] : YAML::Node(YAML::NodeType::Undefined);
  }

  [[noreturn]] std::string Fail(const std::string& key, const YAML::Node& node,
                                const std::string& expected) const {
    throw UsageError(fmt::format("{}: {} is {}, expected {}", Where(key), key, Shown(node), expected));
  }

  static std::string Shown(const YAML::Node& node) {
    if (node.IsScalar()) {
      return fmt::format("'{}'", node.Scalar());
    }
    return node.IsNull() ? "empty" : node.IsMap() ? "a group" : node.size() == 0 ? "an empty list" : "a list";
  }

  YAML::Node node_;
  std::string source_;
  std::string name_;  // in messages: "the experiment", "an entry of grids"
  Words known_;
};

// Numbers of objects; `all` for no limit.
void ReadLimits(YamlGroup& group, std::vector<int>& limits) {
  Words words;
  if (!group.Read("max_objects", words)) {
    return;
  }
  limits.clear();
  for (const std::string& word : words) {
    int limit = kAllObjects;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), limit);
    const bool is_number = error == std::errc() && end == word.data() + word.size() && limit >= 0;
    if (word != "all" && !is_number) {
      throw UsageError(
          fmt::format("{}: max_objects holds '{}', expected whole "
                      "numbers of at least 0, or all",
                      group.Where("max_objects"), word));
    }
    limits.push_back(limit);
  }
}

// Options in a list of key=value, tried out so that a misspelled one is found before the first run.
Words ReadSet(YamlGroup& group) {
  Words assignments;
  group.Read("set", assignments);
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
std::string ReadName(YamlGroup& group, std::string name, const Words& taken) {
  group.Read("name", name);
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

// The names of the variants as a configuration says them: the unnamed one is `default`.
Words VariantWords(const ExperimentConfig& config) {
  Words names = NamesOf(config.variants);
  names.front() = "default";
  return names;
}

ExperimentSequence ReadSequence(YamlGroup& group, const Words& taken) {
  ExperimentSequence sequence;
  group.Read("path", sequence.path);
  group.Read("scene", sequence.scene);
  if (sequence.path.empty() == sequence.scene.empty()) {
    group.ThrowMissing(sequence.path.empty() ? "path" : "only one of path and scene",
                       "path: a sequence folder, or scene: a scene to render");
  }
  const fs::path source = sequence.path.empty() ? sequence.scene : sequence.path;
  const fs::path named = source.has_filename() ? source : source.parent_path();
  sequence.name = ReadName(group, named.stem().string(), taken);
  group.Read("format", sequence.format);
  group.Read("camera", sequence.camera);
  group.Read("detections", sequence.detections);
  group.Read("evaluate", sequence.evaluate);
  group.Read("start", sequence.start, 0);
  group.Read("frames", sequence.frames);
  group.Read("stride", sequence.stride, 1);
  try {
    FramesOf(sequence);
  } catch (const UsageError& error) {
    throw UsageError(fmt::format("{}: {}", group.Where("frames"), error.what()));
  }
  sequence.set = ReadSet(group);
  group.CheckKeys();
  return sequence;
}

// The axes of a grid; those that are missing stay as they are.
void ReadAxes(YamlGroup& group, ExperimentGrid& grid) {
  group.Read("representations", AllNames<Representation>(), grid.representations);
  group.Read("associations", AllNames<AssociationMethod>(), grid.associations);
  group.Read("methods", AllNames<ObjectMethod>(), grid.methods);
  ReadLimits(group, grid.max_objects);
  group.Read("repetitions", grid.repetitions, 1);
}

void ReadGrids(YamlGroup& root, ExperimentConfig& config) {
  const SystemOptions defaults;
  ExperimentGrid common{NamesOf(config.sequences),
                        {NameOf(defaults.objects.representation)},
                        {NameOf(defaults.objects.association.method)},
                        {NameOf(defaults.objects.method)},
                        NamesOf(config.variants),
                        {kAllObjects}};
  ReadAxes(root, common);
  for (YamlGroup& group : root.Groups("grids")) {
    ExperimentGrid grid = common;
    grid.variants = {"default"};
    ReadAxes(group, grid);
    group.Read("sequences", NamesOf(config.sequences), grid.sequences);
    group.Read("variants", VariantWords(config), grid.variants);
    std::replace(grid.variants.begin(), grid.variants.end(), std::string("default"), std::string());
    group.CheckKeys();
    config.grids.push_back(std::move(grid));
  }
  if (config.grids.empty()) {
    config.grids = {common};
  }
}

}  // namespace

FrameRange FramesOf(const ExperimentSequence& sequence) {
  return ParseFrameRange(sequence.frames, sequence.start > 0 ? std::optional(sequence.start) : std::nullopt,
                         sequence.stride);
}

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
  config.output = fs::path("out") / fs::path(source).stem();
  config.variants = {{}};
  root.Read("output", config.output);
  root.Read("config", config.options);
  root.Read("deterministic", config.deterministic);
  root.Read("seed", config.seed, 0);
  root.Read("jobs", config.jobs, 1);
  root.Read("objects", config.objects);
  for (YamlGroup& group : root.Groups("sequences")) {
    config.sequences.push_back(ReadSequence(group, NamesOf(config.sequences)));
  }
  if (config.sequences.empty()) {
    root.ThrowMissing("sequences", "a list of sequences, each with a path or a scene");
  }
  for (YamlGroup& group : root.Groups("variants")) {
    config.variants.push_back({ReadName(group, "", VariantWords(config)), ReadSet(group)});
    group.CheckKeys();
  }
  ReadGrids(root, config);
  root.CheckKeys();
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
