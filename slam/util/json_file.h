#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/limits.h"
#include "slam/util/text_lines.h"

namespace sqslam {

// Reads a JSON file. Throws InputError "FILE:LINE: no valid JSON ..., expected EXPECTED", or if a number with
// a fraction or too many digits is larger than kMaxJsonReal: it would not fit into the whole number that a
// reader may ask for.
template <typename Json = nlohmann::ordered_json>
Json ReadJsonFile(const std::filesystem::path& path, std::string_view expected) {
  const std::string text = ReadFile(path, expected);
  const auto refuse_huge = [](int, typename Json::parse_event_t event, const Json& value) {
    if (event == Json::parse_event_t::value && value.is_number_float() &&
        std::abs(value.template get<double>()) > kMaxJsonReal) {
      throw nlohmann::json::out_of_range::create(406, "number overflow", &value);
    }
    return true;
  };
  try {
    return Json::parse(text, refuse_huge);
  } catch (const nlohmann::json::parse_error& error) {
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(error.byte, text.size()));
    throw InputError("{}:{}: no valid JSON, expected {}", path.string(),
                     1 + std::count(text.begin(), end, '\n'), expected);
  } catch (const nlohmann::json::out_of_range&) {
    throw InputError("{}: a number is beyond all ranges, expected {}", path.string(), expected);
  }
}

// Returns the document indented, with U+FFFD for invalid UTF-8: a bad label must not cost the file.
template <typename Json>
std::string JsonText(const Json& document, int indent = 1) {
  return document.dump(indent, ' ', false, Json::error_handler_t::replace);
}

template <typename Json>
void WriteJsonFile(const std::filesystem::path& path, const Json& document) {
  WriteFileAtomically(path, JsonText(document) + "\n");
}

}  // namespace sqslam
