#include "slam/util/json_file.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/limits.h"
#include "slam/util/text_lines.h"

namespace sqslam {
namespace {

using Json = nlohmann::ordered_json;

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

bool HoldsHugeReal(const Json& value) {
  if (value.is_number_float()) {
    return std::abs(value.get<double>()) > kMaxJsonReal;
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
    // No callback for the parser: with one it looks through all values of a list at the end of each.
    Json document = Json::parse(text);
    if (!HoldsHugeReal(document)) {
      return document;
    }
  } catch (const Json::parse_error& error) {
    throw InputError("{}:{}: invalid JSON, expected {}", path.string(), line_of(error.byte), expected);
  } catch (const Json::out_of_range&) {  // too large for a double: refused below
  }
  throw InputError("{}: a number is out of range, expected {}", path.string(), expected);
}

Json ReadJsonFile(const std::filesystem::path& path, std::string_view expected) {
  return ParseJson(path, ReadText(path, expected), expected);
}

std::string JsonText(const Json& document, int indent) {
  return document.dump(indent, ' ', false, Json::error_handler_t::replace);
}

void WriteJsonFile(const std::filesystem::path& path, const Json& document) {
  WriteFileAtomically(path, JsonText(document) + "\n");
}

}  // namespace sqslam
