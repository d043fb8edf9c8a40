#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace sqslam::app {

// Text made safe for HTML and SVG, attributes included.
std::string EscapeHtml(std::string_view text);

std::string Base64(std::string_view bytes);

// "data:image/png;base64,..." of a file. Throws InputError where it cannot be read.
std::string DataUri(const std::filesystem::path& file, std::string_view mime_type);

// The whole page around its body, with the style sheet.
std::string HtmlPage(const std::string& title, const std::string& body);

// One of the colours that stand for labels: the same for the same position in the sorted list of labels.
std::string_view LabelColor(std::size_t index);

}  // namespace sqslam::app
