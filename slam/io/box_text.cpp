#include "slam/io/box_text.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "slam/util/limits.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// A box in pixels never lies within the first pixel.
bool IsPartOfImage(const Box2d& box) {
  return std::max({std::abs(box.x), std::abs(box.y), box.width, box.height}) <= 1.0;
}

}  // namespace

std::string LabelFrom(const fs::path& path, std::string_view text) {
  const std::string label = NormalizedLabel(ValidText(text));
  ThrowIf<InputError>(label.empty() || label.size() > kMaxLabelBytes,
                      "{}: a label of {} bytes, expected 1 to {}", path.string(), label.size(),
                      kMaxLabelBytes);
  return label;
}

std::vector<std::string> ReadNames(const fs::path& path) {
  std::vector<std::string> names;
  if (fs::exists(path)) {
    for (const TextLine& line : ReadTextLines(path, "the name of a class a line")) {
      names.push_back(LabelFrom(path, line.text));
    }
  }
  return names;
}

double WholeNumberAt(const fs::path& path, const TextLine& line, std::size_t index, double least,
                     std::string_view expected) {
  const double number = NumberAt(path, line, index, expected);
  if (number < least || number > 1e6 || number != static_cast<int>(number)) {
    ThrowBadLine(path, line, expected);
  }
  return number;
}

Box2d BoxAt(const fs::path& path, const TextLine& line, std::size_t first, std::string_view expected) {
  const Box2d box{NumberAt(path, line, first, expected), NumberAt(path, line, first + 1, expected),
                  NumberAt(path, line, first + 2, expected), NumberAt(path, line, first + 3, expected)};
  if (box.width <= 0.0 || box.height <= 0.0) {
    ThrowBadLine(path, line, "a box with w and h above 0");
  }
  return box;
}

std::string ImageStem(const std::string& name) {
  const fs::path file(name);
  const std::string ending = file.extension().string();
  const bool fraction = ending.size() > 1 && ParseNumber<std::uint64_t>(ending.substr(1));
  return (fraction ? file.filename() : file.stem()).string();
}

bool ArePartsOfImage(const std::vector<FileBox>& boxes) {
  return !boxes.empty() &&
         std::ranges::all_of(boxes, [](const FileBox& b) { return IsPartOfImage(b.detection.box); });
}

Box2d Scaled(const Box2d& box, const cv::Size& image) {
  return {box.x * image.width, box.y * image.height, box.width * image.width, box.height * image.height};
}

Box2d AroundCenter(const Box2d& box) {
  return {box.x - 0.5 * box.width, box.y - 0.5 * box.height, box.width, box.height};
}

std::string PlaceOf(const fs::path& path, const TextLine& line) {
  return fmt::format("{}:{}", path.string(), line.number);
}

TextLine SplitAt(TextLine line, char separator) {
  line.words.clear();
  std::size_t begin = 0;
  for (std::size_t end = 0; end != std::string::npos; begin = end + 1) {
    end = line.text.find(separator, begin);
    std::string cell = line.text.substr(begin, end == std::string::npos ? end : end - begin);
    const auto is_around = [](char c) { return c == ' ' || c == '\t' || c == '"' || c == '\r'; };
    cell.erase(cell.begin(), std::ranges::find_if_not(cell, is_around));
    while (!cell.empty() && is_around(cell.back())) {
      cell.pop_back();
    }
    line.words.push_back(std::move(cell));
  }
  return line;
}

}  // namespace sqslam
