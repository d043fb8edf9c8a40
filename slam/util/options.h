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
// Fields are numbers, bool, strings with or without allowed words, enums with names (enum_names.h), arrays of
// double, lists of words, and nested structs with VisitFields.

// An enum option, by the position of its name.
struct EnumOption {
  std::function<std::size_t()> get;
  std::function<void(std::size_t)> set;
};

// One value of an options struct: dotted name, address and allowed values.
struct OptionField {
  using Value = std::variant<int*, std::int64_t*, std::uint64_t*, double*, std::span<double>, bool*,
                             std::string*, EnumOption, std::vector<std::string>*>;

  std::string key;  // e.g. "tracking.features"
  Value value;
  double min = -std::numeric_limits<double>::infinity();  // numbers only, inclusive
  double max = std::numeric_limits<double>::infinity();
  std::vector<std::string> allowed = {};  // names of an enum, or allowed words of a string (empty: any text)
};

// The visitor for VisitFields. Appends to `fields`.
class OptionCollector {
 public:
  explicit OptionCollector(std::vector<OptionField>& fields, std::string prefix = "")
      : fields_(fields), prefix_(std::move(prefix)) {}

  template <typename Number>
  requires std::is_arithmetic_v<Number>
  void operator()(std::string_view name, Number& value, std::type_identity_t<Number> min,
                  std::type_identity_t<Number> max) {
    (*this)(name, value);
    fields_.back().min = static_cast<double>(min);
    fields_.back().max = static_cast<double>(max);
  }
  template <std::size_t N>
  void operator()(std::string_view name, std::array<double, N>& value, double min, double max) {
    Add(name, std::span<double>(value));
    fields_.back().min = min;
    fields_.back().max = max;
  }
  void operator()(std::string_view name, std::string& value, std::initializer_list<const char*> allowed) {
    Add(name, &value);
    fields_.back().allowed.assign(allowed.begin(), allowed.end());
  }
  template <typename Value>
  void operator()(std::string_view name, Value& value) {
    if constexpr (requires { value.VisitFields(*this); }) {
      OptionCollector nested(fields_, prefix_ + std::string(name) + ".");
      value.VisitFields(nested);
    } else if constexpr (NamedEnum<Value>) {
      Add(name, EnumOption{[&value] { return static_cast<std::size_t>(value); },
                           [&value](std::size_t position) { value = static_cast<Value>(position); }});
      fields_.back().allowed = AllNames<Value>();
    } else {
      Add(name, &value);
    }
  }

 private:
  void Add(std::string_view name, OptionField::Value value) {
    fields_.push_back({prefix_ + std::string(name), std::move(value)});
  }

  std::vector<OptionField>& fields_;
  std::string prefix_;
};

// Every value of an options struct, including nested ones, in the order of declaration. The fields point into
// the struct, which must outlive them.
struct OptionFields : std::vector<OptionField> {
  template <typename Options>
  requires requires(Options& options, OptionCollector collector) { options.VisitFields(collector); }
  OptionFields(Options& options) {  // NOLINT: functions below take the struct itself
    OptionCollector collector(*this);
    options.VisitFields(collector);
  }
};

// Returns a field without a name, for a single value.
OptionField FieldOf(auto& value) {
  std::vector<OptionField> fields;
  OptionCollector{fields}("", value);
  return fields.front();
}

// The following functions throw UsageError that names file and line (or the --set), the key, what was
// expected, and for an unknown key the nearest valid one. The struct may then be partly changed.

// Reads a YAML file.
void LoadOptions(const std::filesystem::path& path, const OptionFields& fields);

// Same for YAML text. `source`: its origin, for messages.
void ParseOptions(const std::string& yaml, const std::string& source, const OptionFields& fields);

// Applies the "a.b=value" of --set, with values as in YAML.
void SetOption(const std::string& assignment, const OptionFields& fields);
void SetOptions(const std::vector<std::string>& assignments, const OptionFields& fields);

// Assign from a parsed document: one value, or a map of them with groups, in which keys among `others` are
// ignored. Messages begin with `where`, or with SOURCE:LINE.
void AssignOption(const YAML::Node& node, const OptionField& field, const std::string& where);
void AssignOptions(const YAML::Node& map, const std::string& source, const std::vector<OptionField>& fields,
                   const std::vector<std::string>& others = {});

// Checks ranges and allowed words of a struct that was filled in code.
void CheckFields(const OptionFields& fields);
void CheckOptions(auto options) { CheckFields(options); }

// Returns YAML text that LoadOptions reads back to the same values.
std::string DumpFields(const OptionFields& fields);
std::string DumpOptions(auto options) { return DumpFields(options); }

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
  const OptionFields fields(options);
  const OptionFields other_fields(others);
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

// Returns "; did you mean 'WORD'?" with the candidate that contains the word or has the smallest edit
// distance to it, for the end of an error message; empty if no candidate is near.
std::string DidYouMean(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace sqslam
