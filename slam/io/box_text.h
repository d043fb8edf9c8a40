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

// The text as a label; throws InputError that names the file where it is empty or too long.
std::string LabelFrom(const std::filesystem::path& path, std::string_view text);

// Names of classes, a line each; empty where there is no such file.
std::vector<std::string> ReadNames(const std::filesystem::path& path);

template <typename Names>
std::string ClassName(const Names& names, double number) {
  const auto index = static_cast<std::size_t>(number);
  return index < names.size() ? std::string(names[index]) : fmt::format("class_{}", index);
}

// The number in a cell, which is whole and not below `least`; throws as ThrowBadLine.
double WholeNumberAt(const std::filesystem::path& path, const TextLine& line, std::size_t index, double least,
                     std::string_view expected);

// The box x, y, w, h in four cells; throws as ThrowBadLine.
Box2d BoxAt(const std::filesystem::path& path, const TextLine& line, std::size_t first,
            std::string_view expected);

// The image's name without folder and ending; a time's fraction is no ending.
std::string ImageStem(const std::string& name);

// Tells boxes in parts of the image from boxes in pixels: they all lie within the first pixel.
bool ArePartsOfImage(const std::vector<FileBox>& boxes);

Box2d Scaled(const Box2d& box, const cv::Size& image);
Box2d AroundCenter(const Box2d& box);  // of a box whose x, y are its center

std::string PlaceOf(const std::filesystem::path& path, const TextLine& line);  // FILE:LINE

// The line with its cells as words, without blanks and quotes around them.
TextLine SplitAt(TextLine line, char separator);

std::vector<FileBox> ReadMot(const std::filesystem::path& path);
std::vector<FileBox> ReadTable(const std::filesystem::path& path, const cv::Size& image);  // CSV

}  // namespace sqslam
