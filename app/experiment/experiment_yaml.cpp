#include "app/experiment/experiment_yaml.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace {

std::string ShownText(const YAML::Node& node) {
  if (node.IsNull()) {
    return "empty";
  }
  if (node.IsScalar()) {
    return fmt::format("'{}'", node.Scalar());
  }
  return node.IsMap() ? "a group" : "a list";
}

}  // namespace

YamlGroup::YamlGroup(YAML::Node node, std::string source, std::string name)
    : node_(std::move(node)), source_(std::move(source)), name_(std::move(name)) {
  if (!node_.IsMap()) {
    throw UsageError(
        fmt::format("{}: {} is {}, expected lines 'name: value'", Where(), name_, ShownText(node_)));
  }
}

YAML::Node YamlGroup::Find(const std::string& key) {
  known_.push_back(key);
  const YAML::Node& node = node_;  // looking a key up in a changeable node would insert it
  return node[key] ? node[key] : YAML::Node(YAML::NodeType::Undefined);
}

std::string YamlGroup::Where() const { return fmt::format("{}:{}", source_, node_.Mark().line + 1); }

std::string YamlGroup::Where(const std::string& key) const {
  for (const auto& entry : node_) {
    if (entry.first.IsScalar() && entry.first.Scalar() == key) {
      return fmt::format("{}:{}", source_, entry.first.Mark().line + 1);
    }
  }
  return Where();
}

void YamlGroup::ThrowMissing(const std::string& key, const std::string& expected) const {
  throw UsageError(fmt::format("{}: {} without '{}', expected {}", Where(), name_, key, expected));
}

std::optional<std::string> YamlGroup::Text(const std::string& key) {
  const YAML::Node node = Find(key);
  if (!node.IsDefined()) {
    return std::nullopt;
  }
  if (!node.IsScalar() || node.Scalar().empty()) {
    throw UsageError(fmt::format("{}: {} is {}, expected one word", Where(key), key, ShownText(node)));
  }
  return node.Scalar();
}

std::optional<bool> YamlGroup::Flag(const std::string& key) {
  const YAML::Node node = Find(key);
  if (!node.IsDefined()) {
    return std::nullopt;
  }
  bool value = false;
  if (!node.IsScalar() || !YAML::convert<bool>::decode(node, value)) {
    throw UsageError(fmt::format("{}: {} is {}, expected true or false", Where(key), key, ShownText(node)));
  }
  return value;
}

std::optional<std::int64_t> YamlGroup::Whole(const std::string& key, std::int64_t min) {
  const YAML::Node node = Find(key);
  if (!node.IsDefined()) {
    return std::nullopt;
  }
  std::int64_t value = 0;
  const std::string text = node.IsScalar() ? node.Scalar() : "";
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size() || value < min) {
    throw UsageError(fmt::format("{}: {} is {}, expected a whole number of at least {}", Where(key), key,
                                 ShownText(node), min));
  }
  return value;
}

std::optional<std::vector<std::string>> YamlGroup::Texts(const std::string& key) {
  const YAML::Node node = Find(key);
  if (!node.IsDefined()) {
    return std::nullopt;
  }
  std::vector<std::string> texts;
  if (node.IsScalar()) {
    texts = {node.Scalar()};
  }
  for (std::size_t i = 0; node.IsSequence() && i < node.size(); ++i) {
    if (!node[i].IsScalar()) {
      throw UsageError(fmt::format("{}:{}: {} holds {}, expected a list [..] of words", source_,
                                   node[i].Mark().line + 1, key, ShownText(node[i])));
    }
    texts.push_back(node[i].Scalar());
  }
  if (texts.empty()) {
    throw UsageError(fmt::format("{}: {} is {}, expected a list [..] of words", Where(key), key,
                                 node.IsSequence() ? "an empty list" : ShownText(node)));
  }
  return texts;
}

std::vector<YamlGroup> YamlGroup::Groups(const std::string& key) {
  const YAML::Node node = Find(key);
  std::vector<YamlGroup> groups;
  if (!node.IsDefined()) {
    return groups;
  }
  if (!node.IsSequence() || node.size() == 0) {
    throw UsageError(fmt::format("{}: {} is {}, expected a list of groups that each begin with '-'",
                                 Where(key), key, node.IsSequence() ? "an empty list" : ShownText(node)));
  }
  for (const YAML::Node& item : node) {
    groups.emplace_back(item, source_, "an entry of " + key);
  }
  return groups;
}

void YamlGroup::CheckKeys() const {
  for (const auto& entry : node_) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) {
      continue;
    }
    const std::string nearest = NearestWord(key, known_);
    throw UsageError(fmt::format("{}:{}: unknown key '{}'{}", source_, entry.first.Mark().line + 1, key,
                                 nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest)));
  }
}

}  // namespace sqslam::app
