#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "slam/io/box_formats.h"

namespace sqslam {

// Readers of boxes in lines of text, each for the text of a file (ReadText) or for a folder. `path`: for the
// messages and, except for boxes.txt, for the class names beside it. They throw InputError that names file
// and line. Rows of a table without a box (NaN) are skipped with a warning that counts them.
std::vector<FileBox> ReadBoxLines(const std::filesystem::path& path, std::string_view text);
std::vector<FileBox> ReadBoxFolder(const std::filesystem::path& folder);
std::vector<FileBox> ReadMot(const std::filesystem::path& path, std::string_view text);
std::vector<FileBox> ReadBoxTable(const std::filesystem::path& path, std::string_view text);

// Detects one of these formats (kBoxes, kMot, kCsv) by the first data line; kBoxes if there is none.
BoxFormat FormatOfBoxLines(std::string_view text);

// Returns the text as a label. `place`: FILE or FILE:LINE, for the message. Throws InputError for an empty or
// overlong one.
std::string LabelFrom(const std::string& place, std::string_view text);

// Returns the name of a class of COCO's detectors, from 0; kUnknownClass below 0, "class_93" beyond the last.
std::string CocoClassName(std::int64_t number);

}  // namespace sqslam
