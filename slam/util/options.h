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

// An enum among options, as the position of its name.
struct EnumOption {
  std::function<std::size_t()> get;
  std::function<void(std::size_t)> set;
};

// One value of an options struct, found by visiting it: its dotted name, where it lives and what it may be.
struct OptionField {
  using Value = std::variant<int*, std::int64_t*, std::uint64_t*, double*, std::span<double>, bool*,
                             std::string*, EnumOption, std::vector<std::string>*>;

  std::string key;  // e.g. "tracking.features"
  Value value;
  double min = -std::numeric_limits<double>::infinity();  // numbers only, both ends allowed
  double max = std::numeric_limits<double>::infinity();
  std::vector<std::string> allowed;  // an enum's names; of a string: empty: any text
};

// The visitor that options structs are written for (see the example further down).
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

// Every value of an options struct, nested ones included, in the order of declaration. The fields point into
// `options`, which must outlive them.
std::vector<OptionField> OptionFields(auto& options) {
  std::vector<OptionField> fields;
  options.VisitFields(OptionCollector(fields, ""));
  return fields;
}

// A field without a name, for a value that stands alone.
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

// One value as a command line gives it: `text` is the value itself, not YAML. False, with the value
// unspecified, where the field may not have it.
bool ReadOption(const std::string& text, const OptionField& field);

// "a whole number of at least 3", "one of auto, tum".
std::string OptionExpectation(const OptionField& field);

// The value as ReadOption takes it; empty where the field may not have it, as one that stands for a choice.
std::string OptionText(const OptionField& field);

// The same from a document that the caller has read: one value, or a map of them with its groups, in which
// keys among `others` are passed over. Throw UsageError that begins with `where`, or with SOURCE:LINE.
void AssignOption(const YAML::Node& node, const OptionField& field, const std::string& where);
void AssignOptions(const YAML::Node& map, const std::string& source, const std::vector<OptionField>& fields,
                   const std::vector<std::string>& others = {});

// The work, without templates. `source` names the origin in messages: a file, or "--set".
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
// unknown key the nearest valid one. Where they throw, `options` may have been changed in part.
void LoadOptions(const std::filesystem::path& path, auto& options) {
  LoadOptionFields(path, OptionFields(options));
}

// The same from YAML text.
void ParseOptions(const std::string& yaml, const std::string& source, auto& options) {
  ParseOptionFields(yaml, source, OptionFields(options));
}

// Overrides one value: assignment is "a.b=value", with the value as in YAML.
void SetOption(const std::string& assignment, auto& options) {
  SetOptionField(assignment, OptionFields(options));
}

// Checks ranges and allowed words of a struct that was filled by code.
void CheckOptions(const auto& options) {
  auto copy = options;
  CheckOptionFields(OptionFields(copy));
}

// YAML text that LoadOptions reads back to the same values.
std::string DumpOptions(const auto& options) {
  auto copy = options;
  return DumpOptionFields(OptionFields(copy));
}

// The word of `candidates` with the fewest edits to `word` (Levenshtein); empty where there is none near.
std::string NearestWord(std::string_view word, const std::vector<std::string>& candidates);

// "; did you mean 'WORD'?" for the end of an error message; empty where no candidate is near.
std::string DidYouMean(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace sqslam
