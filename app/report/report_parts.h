#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "app/report/report.h"
#include "render/scene/style.h"

namespace sqslam::app {

// "data:image/png;base64,..." of a file. Throws InputError where it cannot be read.
std::string DataUri(const std::filesystem::path& file, std::string_view mime_type);

// The whole page around its body, with the style sheet.
std::string HtmlPage(const std::string& title, const std::string& body);

// Top view (x to the right, y up, seen against gravity) of the camera path, the ground truth's path where
// there is one, and the outlines of the objects in their colours: an SVG element, empty where there is
// nothing to show.
std::string TopViewSvg(const ReportData& data, const LabelColors& colors);

// Cross-section and side view of one object as two small outlines.
std::string ShapeGlyphSvg(const SnapshotObject& object, const Eigen::Vector3d& color);

}  // namespace sqslam::app
