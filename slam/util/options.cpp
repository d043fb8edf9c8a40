#include "slam/util/options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <type_traits>

#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

std::string Yaml(const auto& value) {
  YAML::Emitter emitter;
  emitter << YAML::Flow << value;
  return emitter.c_str();
}

std::string NodeText(const YAML::Node& node) { return node.IsScalar() ? node.Scalar() : Yaml(node); }

bool IsAmong(const std::string& word, const std::vector<std::string>& words) {
  return std::ranges::find(words, word) != words.end();
}

template <typename Number>
bool ReadNumber(const YAML::Node& node, Number& value) {
  const auto number = node.IsScalar() ? ParseNumber<Number>(node.Scalar()) : std::nullopt;
  value = number.value_or(value);
  return number.has_value();
}

// The visitors of OptionField::value.

// Assigns from YAML; returns false if the node is of the wrong kind.
struct AssignFromNode {
  const YAML::Node& node;
  const OptionField& field;

  bool operator()(auto* number) const { return ReadNumber(node, *number); }
  bool operator()(bool* value) const { return node.IsScalar() && YAML::convert<bool>::decode(node, *value); }
  bool operator()(std::string* value) const {
    *value = NodeText(node);  // a list is kept as text: gravity: [0, 0, 1]
    return !node.IsMap();
  }
  bool operator()(const EnumOption& option) const {
    const auto name = std::ranges::find(field.allowed, node.IsScalar() ? node.Scalar() : "");
    if (name == field.allowed.end()) {
      return false;
    }
    option.set(static_cast<std::size_t>(name - field.allowed.begin()));
    return true;
  }
  bool operator()(std::span<double> values) const {
    bool fits = node.IsSequence() && node.size() == values.size();
    for (std::size_t i = 0; fits && i < values.size(); ++i) {
      fits = ReadNumber(node[i], values[i]);
    }
    return fits;
  }
  bool operator()(std::vector<std::string>* values) const {
    if (node.IsScalar()) {
      *values = {node.Scalar()};
      return true;
    }
    return node.IsSequence() && std::ranges::all_of(node, &YAML::Node::IsScalar) &&
           YAML::convert<std::vector<std::string>>::decode(node, *values);
  }
};

// Returns true if the present value is allowed. NaN and infinity never are.
struct AllowedCheck {
  const OptionField& field;

  bool operator()(const auto* number) const { return *number >= field.min && *number <= field.max; }
  bool operator()(const double* value) const {
    return std::isfinite(*value) && *value >= field.min && *value <= field.max;
  }
  bool operator()(std::span<double> values) const {
    return std::ranges::all_of(values, [&](const double& value) { return (*this)(&value); });
  }
  bool operator()(const bool*) const { return true; }
  bool operator()(const std::string* value) const {
    return field.allowed.empty() || IsAmong(*value, field.allowed);
  }
  bool operator()(const EnumOption& option) const { return option.get() < field.allowed.size(); }
  bool operator()(const std::vector<std::string>*) const { return true; }
};

// Writes the value as YAML.
struct ValueFormat {
  const OptionField& field;

  std::string operator()(const auto* value) const { return fmt::format("{}", *value); }
  std::string operator()(std::span<double> values) const {
    return fmt::format("[{}]", fmt::join(values.begin(), values.end(), ", "));
  }
  std::string operator()(const std::string* value) const { return Yaml(*value); }
  std::string operator()(const EnumOption& option) const {
    const std::size_t position = option.get();
    return position < field.allowed.size() ? Yaml(field.allowed[position]) : "without a name";
  }
  std::string operator()(const std::vector<std::string>* values) const { return Yaml(*values); }
};

struct Expectation {
  const OptionField& field;

  std::string operator()(const auto*) const { return InRange("a whole number"); }
  std::string operator()(const std::uint64_t*) const { return InRange("a whole number without sign"); }
  std::string operator()(const double*) const { return InRange("a number"); }
  std::string operator()(std::span<double> values) const {
    return fmt::format("a list [..] of {} values, each {}", values.size(), InRange("a number"));
  }
  std::string operator()(const bool*) const { return "true or false"; }
  std::string operator()(const std::string*) const {
    return field.allowed.empty() ? "one line of text" : (*this)(EnumOption());
  }
  std::string operator()(const EnumOption&) const {
    return fmt::format("one of {}", fmt::join(field.allowed, ", "));
  }
  std::string operator()(const std::vector<std::string>*) const { return "a list [..] of words"; }

  // "a number from 0 to 1", "a whole number of at least 3", ...
  std::string InRange(const std::string& noun) const {
    const bool has_min = std::isfinite(field.min);
    const bool has_max = std::isfinite(field.max);
    return has_min && has_max ? fmt::format("{} from {} to {}", noun, field.min, field.max)
           : has_min          ? fmt::format("{} of at least {}", noun, field.min)
           : has_max          ? fmt::format("{} of at most {}", noun, field.max)
                              : noun;
  }
};

bool IsAllowed(const OptionField& field) { return std::visit(AllowedCheck{field}, field.value); }

std::string FormatValue(const OptionField& field) { return std::visit(ValueFormat{field}, field.value); }

const OptionField* Find(const std::vector<OptionField>& fields, const std::string& key) {
  const auto it = std::ranges::find(fields, key, &OptionField::key);
  return it == fields.end() ? nullptr : &*it;
}

bool IsGroup(const std::vector<OptionField>& fields, const std::string& key) {
  return std::ranges::any_of(fields, [&](const auto& field) { return field.key.starts_with(key + "."); });
}

[[noreturn]] void ThrowUnknown(const std::string& where, const std::string& key,
                               const std::vector<OptionField>& fields, std::vector<std::string> keys = {}) {
  std::ranges::copy(ToVector(fields, &OptionField::key), std::back_inserter(keys));
  throw UsageError("{}: unknown option '{}'{}", where, key, DidYouMean(key, keys));
}

void AssignGroup(const YAML::Node& group, const std::string& prefix, const std::string& source,
                 const std::vector<OptionField>& fields, const std::vector<std::string>& others) {
  for (const auto& entry : group) {
    const std::string key = prefix + NodeText(entry.first);
    const std::string where = fmt::format("{}:{}", source, entry.first.Mark().line + 1);
    if (const OptionField* field = Find(fields, key)) {
      AssignOption(entry.second, *field, where);
    } else if (!IsGroup(fields, key)) {
      if (!IsAmong(key, others)) {
        ThrowUnknown(where, key, fields, others);
      }
    } else if (entry.second.IsMap()) {
      AssignGroup(entry.second, key + ".", source, fields, others);
    } else if (!entry.second.IsNull()) {  // a group with all entries commented out is fine
      throw UsageError("{}: {} is '{}', expected a group of options", where, key, NodeText(entry.second));
    }
  }
}

std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row.back();
}

// Returns the candidate that ends with the word or else contains it, otherwise the one with the smallest edit
// distance; empty if that is large.
std::string NearestWord(std::string_view word, const std::vector<std::string>& candidates) {
  const std::string_view bare = word.substr(std::min(word.find_first_not_of('-'), word.size()));
  constexpr std::size_t kMinPart = 3;  // letters
  if (bare.size() >= kMinPart) {
    auto longer = std::ranges::find_if(candidates, [&](const auto& c) { return c.ends_with(bare); });
    if (longer == candidates.end()) {
      longer =
          std::ranges::find_if(candidates, [&](const auto& c) { return c.find(bare) != std::string::npos; });
    }
    if (longer != candidates.end()) {
      return *longer;
    }
  }
  std::string nearest;
  std::size_t best = std::max<std::size_t>(2, word.size() / 2) + 1;  // anything farther is not a misspelling
  for (const std::string& candidate : candidates) {
    const auto [shorter, longer] = std::minmax({word.size(), candidate.size()});
    if (longer - shorter >= best) {
      continue;  // spares the comparison with words of thousands of letters
    }
    const std::size_t distance = EditDistance(word, candidate);
    if (distance < best) {
      best = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

}  // namespace

std::string DidYouMean(std::string_view word, const std::vector<std::string>& candidates) {
  const std::string nearest = NearestWord(word, candidates);
  return nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest);
}

std::string OptionExpectation(const OptionField& field) {
  return std::visit(Expectation{field}, field.value);
}

bool ReadOption(const std::string& text, const OptionField& field) {
  return std::visit(AssignFromNode{YAML::Node(text), field}, field.value) && IsAllowed(field);
}

std::string OptionText(const OptionField& field) {
  if (!IsAllowed(field)) {
    return "";
  }
  const auto* text = std::get_if<std::string*>(&field.value);
  return text != nullptr ? **text : FormatValue(field);
}

void AssignOption(const YAML::Node& node, const OptionField& field, const std::string& where) {
  if (!std::visit(AssignFromNode{node, field}, field.value) || !IsAllowed(field)) {
    throw UsageError("{}: {} is {}, expected {}{}", where, field.key,
                     node.IsNull() ? "empty" : "'" + NodeText(node) + "'", OptionExpectation(field),
                     node.IsScalar() ? DidYouMean(node.Scalar(), field.allowed) : "");
  }
}

void AssignOptions(const YAML::Node& map, const std::string& source, const std::vector<OptionField>& fields,
                   const std::vector<std::string>& others) {
  if (!map.IsMap() && !map.IsNull()) {
    throw UsageError("{}:{}: '{}', expected lines 'name: value'", source, map.Mark().line + 1, NodeText(map));
  }
  AssignGroup(map, "", source, fields, others);
}

void LoadOptions(const std::filesystem::path& path, const OptionFields& fields) {
  std::string text;
  try {
    text = ReadText(path, "a YAML file of options");
  } catch (const InputError& e) {
    throw UsageError(e.what());
  }
  ParseOptions(text, path.string(), fields);
}

void ParseOptions(const std::string& yaml, const std::string& source, const OptionFields& fields) {
  YAML::Node root;
  try {
    root = YAML::Load(yaml);
  } catch (const YAML::ParserException& e) {
    throw UsageError("{}:{}: invalid YAML: {}", source, e.mark.line + 1, e.msg);
  }
  AssignOptions(root, source, fields);
}

void SetOption(const std::string& assignment, const OptionFields& fields) {
  const std::size_t equals = assignment.find('=');
  const std::string where = "--set " + assignment;
  if (equals == std::string::npos || equals == 0) {
    throw UsageError(where + ": expected key=value");
  }
  const std::string key = assignment.substr(0, equals);
  const OptionField* field = Find(fields, key);
  ThrowIf<UsageError>(field == nullptr && IsGroup(fields, key),
                      "{}: '{}' is a group of options, expected one of its values", where, key);
  if (field == nullptr) {
    ThrowUnknown(where, key, fields);
  }
  YAML::Node node;
  try {
    node = YAML::Load(assignment.substr(equals + 1));
  } catch (const YAML::ParserException& e) {
    throw UsageError("{}: invalid YAML value: {}", where, e.msg);
  }
  AssignOption(node, *field, where);
}

void SetOptions(const std::vector<std::string>& assignments, const OptionFields& fields) {
  for (const std::string& assignment : assignments) {
    SetOption(assignment, fields);
  }
}

void CheckFields(const OptionFields& fields) {
  for (const OptionField& field : fields) {
    if (!IsAllowed(field)) {
      throw UsageError("option {} is {}, expected {}", field.key, FormatValue(field),
                       OptionExpectation(field));
    }
  }
}

std::string DumpFields(const OptionFields& fields) {
  std::string text;
  std::vector<std::string> open;  // groups whose header has been written
  for (const OptionField& field : fields) {
    const std::vector<std::string> parts = Split(field.key, '.');
    const std::size_t depth = parts.size() - 1;
    const auto shared = std::mismatch(open.begin(), open.end(), parts.begin(), parts.begin() + depth).first;
    open.erase(shared, open.end());
    while (open.size() < depth) {
      text += fmt::format("{:{}}{}:\n", "", 2 * open.size(), parts[open.size()]);
      open.push_back(parts[open.size()]);
    }
    text += fmt::format("{:{}}{}: {}\n", "", 2 * depth, parts.back(), FormatValue(field));
  }
  return text;
}

}  // namespace sqslam
