#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace sqslam {

// Reads a JSON file. Throws InputError "FILE:LINE: invalid JSON, expected EXPECTED", also if lists and
// objects are nested deeper than kMaxJsonDepth, or if a real number exceeds kMaxJsonReal: it would not fit
// into the integer that a reader may ask for.
nlohmann::ordered_json ReadJsonFile(const std::filesystem::path& path, std::string_view expected);

// Same for the text of the file.
nlohmann::ordered_json ParseJson(const std::filesystem::path& path, const std::string& text,
                                 std::string_view expected);

// Returns the document indented, with U+FFFD for invalid UTF-8: a bad label must not prevent the file.
std::string JsonText(const nlohmann::ordered_json& document, int indent = 1);
void WriteJsonFile(const std::filesystem::path& path, const nlohmann::ordered_json& document);

}  // namespace sqslam
