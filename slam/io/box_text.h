#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/io/box_formats.h"
#include "slam/util/text_lines.h"

// Helpers that the readers of box files share; only box_formats.cpp and box_tables.cpp include them.
namespace sqslam {

// Returns the text as a label. Throws InputError that names the file if it is empty or too long.
std::string LabelFrom(const std::filesystem::path& path, std::string_view text);

// Reads class names, one per line; empty if there is no such file.
std::vector<std::string> ReadNames(const std::filesystem::path& path);

template <typename Names>
std::string ClassName(const Names& names, double number) {
  const auto index = static_cast<std::size_t>(number);
  return index < names.size() ? std::string(names[index]) : fmt::format("class_{}", index);
}

// Returns the whole number in a cell, at least `least`. Throws as ThrowBadLine.
double WholeNumberAt(const std::filesystem::path& path, const TextLine& line, std::size_t index, double least,
                     std::string_view expected);

// Returns the box x, y, w, h in four cells. Throws as ThrowBadLine.
Box2d BoxAt(const std::filesystem::path& path, const TextLine& line, std::size_t first,
            std::string_view expected);

// Returns the image's name without folder and extension; a timestamp's fraction is no extension.
std::string ImageStem(const std::string& name);

// Returns true if the boxes are in parts of the image, not in pixels: all lie within the first pixel.
bool ArePartsOfImage(const std::vector<FileBox>& boxes);

Box2d Scaled(const Box2d& box, const cv::Size& image);
Box2d AroundCenter(const Box2d& box);  // of a box whose x, y are its center

std::string PlaceOf(const std::filesystem::path& path, const TextLine& line);  // FILE:LINE

// Returns the line with its cells as words, without surrounding blanks and quotes.
TextLine SplitAt(TextLine line, char separator);

// `text`: what the file holds.
std::vector<FileBox> ReadMot(const std::filesystem::path& path, std::string_view text);
std::vector<FileBox> ReadTable(const std::filesystem::path& path, std::string_view text,
                               const cv::Size& image);  // CSV

}  // namespace sqslam
