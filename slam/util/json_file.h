#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "slam/util/atomic_file.h"

namespace sqslam {

// Reads a JSON file. Throws InputError "FILE:LINE: no valid JSON ..., expected EXPECTED", or if lists and
// objects are nested deeper than kMaxJsonDepth, or if a number with a fraction or too many digits is larger
// than kMaxJsonReal: it would not fit into the whole number that a reader may ask for.
template <typename Json = nlohmann::ordered_json>
Json ReadJsonFile(const std::filesystem::path& path, std::string_view expected);

// The same for the text of the file.
template <typename Json = nlohmann::ordered_json>
Json ParseJson(const std::filesystem::path& path, const std::string& text, std::string_view expected);

// Returns the document indented, with U+FFFD for invalid UTF-8: a bad label must not cost the file.
template <typename Json>
std::string JsonText(const Json& document, int indent = 1);

// One source pays for the parser and the writer.
extern template nlohmann::json ReadJsonFile(const std::filesystem::path&, std::string_view);
extern template nlohmann::ordered_json ReadJsonFile(const std::filesystem::path&, std::string_view);
extern template nlohmann::json ParseJson(const std::filesystem::path&, const std::string&, std::string_view);
extern template nlohmann::ordered_json ParseJson(const std::filesystem::path&, const std::string&,
                                                 std::string_view);
extern template std::string JsonText(const nlohmann::json&, int);
extern template std::string JsonText(const nlohmann::ordered_json&, int);

template <typename Json>
void WriteJsonFile(const std::filesystem::path& path, const Json& document) {
  WriteFileAtomically(path, JsonText(document) + "\n");
}

}  // namespace sqslam
