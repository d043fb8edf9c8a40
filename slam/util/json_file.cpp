#include "slam/util/json_file.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "slam/util/error.h"
#include "slam/util/limits.h"
#include "slam/util/text_lines.h"

namespace sqslam {
namespace {

// Returns the first place where lists and objects are nested too deep, if there is one.
std::optional<std::size_t> TooDeepAt(std::string_view text) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (in_string) {
      at += c == '\\' ? 1 : 0;
      in_string = c != '"';
    } else if (c == '[' || c == '{') {
      if (++depth > kMaxJsonDepth) {
        return at;
      }
    } else if (c == ']' || c == '}') {
      --depth;
    } else {
      in_string = c == '"';
    }
  }
  return std::nullopt;
}

template <typename Json>
bool HoldsHugeReal(const Json& value) {
  if (value.is_number_float()) {
    return std::abs(value.template get<double>()) > kMaxJsonReal;
  }
  if (value.is_structured()) {
    for (const Json& part : value) {
      if (HoldsHugeReal(part)) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace

template <typename Json>
Json ParseJson(const std::filesystem::path& path, const std::string& text, std::string_view expected) {
  const auto line_of = [&](std::size_t at) {
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(at, text.size()));
    return 1 + std::count(text.begin(), end, '\n');
  };
  if (const std::optional<std::size_t> at = TooDeepAt(text)) {
    throw InputError("{}:{}: nested deeper than {} levels, expected {}", path.string(), line_of(*at),
                     kMaxJsonDepth, expected);
  }
  try {
    // Without a callback: with one the parser looks through all values of a list at the end of each.
    Json document = Json::parse(text);
    if (!HoldsHugeReal(document)) {
      return document;
    }
  } catch (const nlohmann::json::parse_error& error) {
    throw InputError("{}:{}: no valid JSON, expected {}", path.string(), line_of(error.byte), expected);
  } catch (const nlohmann::json::out_of_range&) {  // beyond what a double can hold: refused below
  }
  throw InputError("{}: a number is beyond all ranges, expected {}", path.string(), expected);
}

template <typename Json>
Json ReadJsonFile(const std::filesystem::path& path, std::string_view expected) {
  return ParseJson<Json>(path, ReadFile(path, expected), expected);
}

template <typename Json>
std::string JsonText(const Json& document, int indent) {
  return document.dump(indent, ' ', false, Json::error_handler_t::replace);
}

template nlohmann::json ReadJsonFile(const std::filesystem::path&, std::string_view);
template nlohmann::ordered_json ReadJsonFile(const std::filesystem::path&, std::string_view);
template nlohmann::json ParseJson(const std::filesystem::path&, const std::string&, std::string_view);
template nlohmann::ordered_json ParseJson(const std::filesystem::path&, const std::string&, std::string_view);
template std::string JsonText(const nlohmann::json&, int);
template std::string JsonText(const nlohmann::ordered_json&, int);

}  // namespace sqslam
