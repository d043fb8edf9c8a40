#pragma once

#include <string>
#include <vector>

#include "slam/util/options.h"

namespace sqslam {

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

}  // namespace sqslam
