#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "slam/util/enum_names.h"

namespace YAML {
class Node;
}

namespace sqslam {

// An enum option, by the position of its name.
struct EnumOption {
  std::function<std::size_t()> get;
  std::function<void(std::size_t)> set;
};

// One value of an options struct, found by visiting it: dotted name, address and allowed values.
struct OptionField {
  using Value = std::variant<int*, std::int64_t*, std::uint64_t*, double*, std::span<double>, bool*,
                             std::string*, EnumOption, std::vector<std::string>*>;

  std::string key;  // e.g. "tracking.features"
  Value value;
  double min = -std::numeric_limits<double>::infinity();  // numbers only, inclusive
  double max = std::numeric_limits<double>::infinity();
  std::vector<std::string> allowed;  // names of an enum, or allowed words of a string (empty: any text)
};

// The visitor for VisitFields of options structs (see the example below).
class OptionCollector {
 public:
  OptionCollector(std::vector<OptionField>& fields, std::string prefix)
      : fields_(fields), prefix_(std::move(prefix)) {}

  template <typename Number>
  requires std::is_arithmetic_v<Number>
  void operator()(std::string_view name, Number& value, std::type_identity_t<Number> min,
                  std::type_identity_t<Number> max) {
    Add(name, &value, static_cast<double>(min), static_cast<double>(max));
  }
  void operator()(std::string_view name, std::uint64_t& value) { Add(name, &value); }  // a seed: any number
  template <std::size_t N>
  void operator()(std::string_view name, std::array<double, N>& value, double min, double max) {
    Add(name, std::span<double>(value), min, max);
  }
  void operator()(std::string_view name, bool& value) { Add(name, &value); }
  void operator()(std::string_view name, std::string& value,
                  std::initializer_list<const char*> allowed = {}) {
    Add(name, &value);
    fields_.back().allowed.assign(allowed.begin(), allowed.end());
  }
  void operator()(std::string_view name, std::vector<std::string>& value) { Add(name, &value); }
  template <NamedEnum Enum>
  void operator()(std::string_view name, Enum& value) {
    Add(name, EnumOption{[&value] { return static_cast<std::size_t>(value); },
                         [&value](std::size_t position) { value = static_cast<Enum>(position); }});
    fields_.back().allowed = AllNames<Enum>();
  }

  template <typename Nested>
  requires requires(Nested& nested, OptionCollector& visitor) { nested.VisitFields(visitor); }
  void operator()(std::string_view name, Nested& nested) {
    nested.VisitFields(OptionCollector(fields_, prefix_ + std::string(name) + "."));
  }

 private:
  void Add(std::string_view name, OptionField::Value value,
           double min = -std::numeric_limits<double>::infinity(),
           double max = std::numeric_limits<double>::infinity()) {
    fields_.push_back({prefix_ + std::string(name), std::move(value), min, max, {}});
  }

  std::vector<OptionField>& fields_;
  std::string prefix_;
};

// Returns every value of an options struct, including nested ones, in the order of declaration. The fields
// point into `options`, which must outlive them.
std::vector<OptionField> OptionFields(auto& options) {
  std::vector<OptionField> fields;
  options.VisitFields(OptionCollector(fields, ""));
  return fields;
}

// Returns a field without a name, for a single value.
template <typename T>
OptionField FieldOf(T& value) {
  if constexpr (NamedEnum<T>) {
    std::vector<OptionField> fields;
    OptionCollector(fields, "")("", value);
    return fields.front();
  } else {
    OptionField field;
    field.value = &value;
    return field;
  }
}

// Reads a value from a command line: `text` is the value itself, not YAML. Returns false, with the value
// unspecified, if the field does not allow it.
bool ReadOption(const std::string& text, const OptionField& field);

// Returns for example "a whole number of at least 3" or "one of auto, tum".
std::string OptionExpectation(const OptionField& field);

// Returns the value as ReadOption takes it; empty if the field does not allow its present value.
std::string OptionText(const OptionField& field);

// Returns key, value and other value of each option in which two structs differ, as `text` writes values.
template <typename Options>
std::vector<std::array<std::string, 3>> ChangedOptions(
    Options options, Options others,
    const std::function<std::string(const OptionField&)>& text = OptionText) {
  const std::vector<OptionField> fields = OptionFields(options);
  const std::vector<OptionField> other_fields = OptionFields(others);
  std::vector<std::array<std::string, 3>> changed;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const std::string value = text(fields[i]);
    const std::string other = text(other_fields[i]);
    if (value != other) {
      changed.push_back({fields[i].key, value, other});
    }
  }
  return changed;
}

// Assign from a parsed document: one value, or a map of them with groups, in which keys among `others` are
// ignored. Throw UsageError that begins with `where`, or with SOURCE:LINE.
void AssignOption(const YAML::Node& node, const OptionField& field, const std::string& where);
void AssignOptions(const YAML::Node& map, const std::string& source, const std::vector<OptionField>& fields,
                   const std::vector<std::string>& others = {});

// Implementations without templates. `source`: origin for messages, a file or "--set".
void LoadOptionFields(const std::filesystem::path& path, const std::vector<OptionField>& fields);
void ParseOptionFields(const std::string& yaml, const std::string& source,
                       const std::vector<OptionField>& fields);
void SetOptionField(const std::string& assignment, const std::vector<OptionField>& fields);
void CheckOptionFields(const std::vector<OptionField>& fields);
std::string DumpOptionFields(const std::vector<OptionField>& fields);

// Options are plain structs that declare names and ranges once, in VisitFields:
//
//   struct EifOptions {
//     int trees = 40;          // number of isolation trees
//     double threshold = 0.6;  // anomaly score above which a point is removed, in [0, 1]
//     void VisitFields(auto&& visit) {
//       visit("trees", trees, 1, 1000);
//       visit("threshold", threshold, 0.0, 1.0);
//     }
//   };
//   EifOptions options;
//   LoadOptions("my.yaml", options);
//   SetOption("threshold=0.5", options);
//
// All throw UsageError that names file and line (or the --set), the key, what was expected, and for an
// unknown key the nearest valid one. `options` may then be partly changed.
void LoadOptions(const std::filesystem::path& path, auto& options) {
  LoadOptionFields(path, OptionFields(options));
}

// Same for YAML text.
void ParseOptions(const std::string& yaml, const std::string& source, auto& options) {
  ParseOptionFields(yaml, source, OptionFields(options));
}

// Overrides one value: assignment is "a.b=value", with the value as in YAML.
void SetOption(const std::string& assignment, auto& options) {
  SetOptionField(assignment, OptionFields(options));
}

// Checks ranges and allowed words of a struct that was filled in code.
void CheckOptions(const auto& options) {
  auto copy = options;
  CheckOptionFields(OptionFields(copy));
}

// Returns YAML text that LoadOptions reads back to the same values.
std::string DumpOptions(const auto& options) {
  auto copy = options;
  return DumpOptionFields(OptionFields(copy));
}

// Returns the word of `candidates` with the smallest edit distance to `word`; empty if none is near.
std::string NearestWord(std::string_view word, const std::vector<std::string>& candidates);

// Returns "; did you mean 'WORD'?" for the end of an error message; empty if no candidate is near.
std::string DidYouMean(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace sqslam
