#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace sqslam::app {

// "data:image/png;base64,..." of a file. Throws InputError where it cannot be read.
std::string DataUri(const std::filesystem::path& file, std::string_view mime_type);

// The whole page around its body, with the style sheet.
std::string HtmlPage(const std::string& title, const std::string& body);

}  // namespace sqslam::app
