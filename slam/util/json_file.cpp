#include "slam/util/json_file.h"

#include <algorithm>
#include <cmath>

#include "slam/util/error.h"
#include "slam/util/limits.h"
#include "slam/util/text_lines.h"

namespace sqslam {

template <typename Json>
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

template <typename Json>
std::string JsonText(const Json& document, int indent) {
  return document.dump(indent, ' ', false, Json::error_handler_t::replace);
}

template nlohmann::json ReadJsonFile(const std::filesystem::path&, std::string_view);
template nlohmann::ordered_json ReadJsonFile(const std::filesystem::path&, std::string_view);
template std::string JsonText(const nlohmann::json&, int);
template std::string JsonText(const nlohmann::ordered_json&, int);

}  // namespace sqslam
