#include "slam/io/box_formats.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "slam/io/box_text.h"
#include "slam/io/coco.h"
#include "slam/util/json_file.h"
#include "slam/util/limits.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

// Decodes the text that pycocotools writes: groups of five bits, lowest first, with a bit for "more follows";
// from the fourth count on differences to the one before the last.
std::vector<std::int64_t> CountsOf(std::string_view text, const std::string& place) {
  constexpr int kBits = 5;
  constexpr int kMaxBits = 40;
  std::vector<std::int64_t> counts;
  for (std::size_t at = 0; at < text.size();) {
    std::int64_t value = 0;
    bool more = true;
    for (int shift = 0; more; shift += kBits) {
      const int group = at < text.size() ? text[at++] - '0' : -1;
      ThrowIf<InputError>(group < 0 || group > 0x3f || shift > kMaxBits,
                          "{}: expected a mask with counts as pycocotools writes them", place);
      value |= std::int64_t{group & 0x1f} << shift;
      more = (group & 0x20) != 0;
      if (!more && (group & 0x10) != 0) {
        value -= std::int64_t{1} << (shift + kBits);  // negative
      }
    }
    counts.push_back(counts.size() > 2 ? value + counts[counts.size() - 2] : value);
  }
  return counts;
}

// Runs go down the columns of the image, in turn outside and inside the mask.
Box2d BoundsOfRuns(const std::vector<std::int64_t>& counts, std::int64_t height, std::int64_t width,
                   const std::string& place) {
  std::int64_t left = width, top = height, right = 0, bottom = 0;
  std::int64_t begin = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    ThrowIf<InputError>(counts[i] < 0 || counts[i] > height * width - begin,
                        "{}: its mask has other runs than an image of {}x{}", place, width, height);
    const std::int64_t end = begin + counts[i];
    if (i % 2 == 1 && end > begin) {
      const bool one_column = begin / height == (end - 1) / height;
      left = std::min(left, begin / height);
      right = std::max(right, (end - 1) / height + 1);
      top = std::min(top, one_column ? begin % height : 0);
      bottom = std::max(bottom, one_column ? (end - 1) % height + 1 : height);
    }
    begin = end;
  }
  return {static_cast<double>(left), static_cast<double>(top),
          static_cast<double>(std::max<std::int64_t>(0, right - left)),
          static_cast<double>(std::max<std::int64_t>(0, bottom - top))};
}

Box2d BoundsOfPolygons(const Json& polygons, const std::string& place) {
  Eigen::AlignedBox2d bounds;
  for (const Json& polygon : polygons) {
    const auto numbers = polygon.get<std::vector<double>>();
    ThrowIf<InputError>(numbers.size() < 6 || numbers.size() % 2 != 0,
                        "{}: expected polygons [x, y, x, y, x, y, ...]", place);
    for (std::size_t i = 0; i < numbers.size(); i += 2) {
      bounds.extend(Eigen::Vector2d(numbers[i], numbers[i + 1]));
    }
  }
  if (bounds.isEmpty()) {
    return {};
  }
  return {bounds.min().x(), bounds.min().y(), bounds.sizes().x(), bounds.sizes().y()};
}

}  // namespace

Box2d BoundsOfMask(const Json& segmentation, const std::string& place) {
  if (segmentation.is_array()) {
    return BoundsOfPolygons(segmentation, place);
  }
  const auto height = segmentation.at("size").at(0).get<std::int64_t>();
  const auto width = segmentation.at("size").at(1).get<std::int64_t>();
  ThrowIf<InputError>(std::min(height, width) < 1 || std::max(height, width) > kMaxImageSide,
                      "{}: its mask is {}x{}, expected sides of 1 to {}", place, width, height,
                      kMaxImageSide);
  const Json& counts = segmentation.at("counts");
  return BoundsOfRuns(counts.is_string() ? CountsOf(counts.get<std::string>(), place)
                                         : counts.get<std::vector<std::int64_t>>(),
                      height, width, place);
}

namespace {

constexpr const char* kBoxesLine = "'timestamp label score x y w h [object_id [visible_fraction]]'";

// COCO's category ids go up to 90 and skip these.
constexpr std::array kCocoGaps = {12, 26, 29, 30, 45, 66, 68, 69, 71, 83};

// ---- boxes.txt

std::vector<FileBox> ReadBoxes(const fs::path& path, std::string_view text) {
  std::vector<FileBox> boxes;
  for (const TextLine& line : TextLinesIn(text)) {
    if (line.words.size() < 7 || line.words.size() > 9) {
      ThrowBadLine(path, line, kBoxesLine);
    }
    const double timestamp = NumberAt(path, line, 0, kBoxesLine);
    const std::string label = ValidText(line.words[1]);
    if (label.size() > kMaxLabelBytes) {
      ThrowBadLine(path, line, fmt::format("a label of at most {} bytes", kMaxLabelBytes));
    }
    for (std::size_t i = 7; i < line.words.size(); ++i) {
      NumberAt(path, line, i, kBoxesLine);
    }
    boxes.push_back({PlaceOf(path, line),
                     FrameTime{timestamp},
                     {label, NumberAt(path, line, 2, kBoxesLine), BoxAt(path, line, 3, kBoxesLine)}});
  }
  if (ArePartsOfImage(boxes)) {
    throw InputError(
        "{}: all boxes are smaller than a pixel, as if they were parts of the image; expected x y w h in "
        "pixels from the top-left corner",
        path.string());
  }
  return boxes;
}

// ---- A file for each frame

std::vector<FileBox> ReadFolder(const fs::path& folder, const cv::Size& image) {
  constexpr const char* kExpected =
      "'class x y w h score' in pixels, or 'class cx cy w h [score]' in parts of the image";
  const fs::path names_file = folder / "classes.txt";
  const std::vector<std::string> names = ReadNames(names_file);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".txt" && entry.path() != names_file) {
      files.push_back(entry.path());
    }
  }
  ThrowIf<InputError>(files.empty(), "{}: no text file in it, expected one for each frame with boxes",
                      folder.string());
  std::ranges::sort(files);  // same order of warnings on every machine
  std::vector<FileBox> boxes;
  std::optional<std::string> without_score;
  for (const fs::path& file : files) {
    for (const TextLine& line : ReadTextLines(file, "a file with the boxes of one frame")) {
      const double number = WholeNumberAt(file, line, 0, 0.0, kExpected);
      if (line.words.size() < 5 || line.words.size() > 6) {
        ThrowBadLine(file, line, kExpected);
      }
      const bool scored = line.words.size() == 6;
      without_score = scored || without_score ? without_score : PlaceOf(file, line);
      boxes.push_back({PlaceOf(file, line),
                       file.stem().string(),
                       {names.empty() ? ClassName(kCocoNames, number) : ClassName(names, number),
                        scored ? NumberAt(file, line, 5, kExpected) : 1.0, BoxAt(file, line, 1, kExpected)}});
    }
  }
  const bool parts = ArePartsOfImage(boxes);
  if (!parts && without_score) {
    throw InputError("{}: a box without a score in a folder with boxes in pixels, expected {}",
                     *without_score, kExpected);
  }
  for (FileBox& box : boxes) {
    box.detection.box = parts ? AroundCenter(Scaled(box.detection.box, image)) : box.detection.box;
  }
  return boxes;
}

// ---- COCO

std::string CocoName(std::int64_t category) {
  const auto gaps = std::ranges::count_if(kCocoGaps, [&](int gap) { return gap <= category; });
  return category < 1 || std::ranges::count(kCocoGaps, category) > 0
             ? fmt::format("class_{}", category)
             : ClassName(kCocoNames, static_cast<double>(category - 1 - gaps));
}

struct CocoTables {
  std::map<std::int64_t, std::string> images;  // file names
  std::map<std::int64_t, std::string> categories;
};

// Segmenters often write no box beside a mask.
Box2d CocoBounds(const nlohmann::ordered_json& entry, const std::string& place) {
  if (!entry.contains("bbox") && entry.contains("segmentation")) {
    return BoundsOfMask(entry.at("segmentation"), place);
  }
  const nlohmann::ordered_json& corners = entry.at("bbox");
  return {corners.at(0).get<double>(), corners.at(1).get<double>(), corners.at(2).get<double>(),
          corners.at(3).get<double>()};
}

FileBox BoxOf(const fs::path& path, std::string place, const nlohmann::ordered_json& entry,
              const CocoTables& tables) {
  const Box2d box = CocoBounds(entry, place);
  ThrowIf<InputError>(!(box.width > 0.0) || !(box.height > 0.0),
                      "{}: expected a bbox [x, y, w, h] with w and h above 0, or a mask with something in it",
                      place);
  const auto category = entry.at("category_id").get<std::int64_t>();
  const auto name = tables.categories.find(category);
  const std::string label = name != tables.categories.end() ? name->second : CocoName(category);
  FrameKey frame = std::string();
  if (const nlohmann::ordered_json& id = entry.at("image_id"); id.is_string()) {
    frame = ImageStem(id.get<std::string>());
  } else if (tables.images.empty()) {
    frame = ImageNumber{id.get<std::int64_t>()};
  } else if (const auto image = tables.images.find(id.get<std::int64_t>()); image != tables.images.end()) {
    frame = ImageStem(image->second);
  } else {
    throw InputError("{}: image_id {} is not among the images", place, id.get<std::int64_t>());
  }
  return {std::move(place), std::move(frame), {LabelFrom(path, label), entry.value("score", 1.0), box}};
}

std::vector<FileBox> ReadCoco(const fs::path& path, const std::string& text) {
  constexpr const char* kExpected =
      "COCO's annotations or results: image_id, category_id, bbox [x, y, w, h] and a score for each box";
  const nlohmann::ordered_json document = ParseJson(path, text, kExpected);
  std::vector<FileBox> boxes;
  try {
    CocoTables tables;
    if (document.is_object()) {
      for (const nlohmann::ordered_json& image : document.value("images", nlohmann::ordered_json::array())) {
        tables.images[image.at("id").get<std::int64_t>()] = image.at("file_name").get<std::string>();
      }
      for (const nlohmann::ordered_json& category :
           document.value("categories", nlohmann::ordered_json::array())) {
        tables.categories[category.at("id").get<std::int64_t>()] = category.at("name").get<std::string>();
      }
    }
    const nlohmann::ordered_json& entries = document.is_object() ? document.at("annotations") : document;
    for (const nlohmann::ordered_json& entry : entries) {
      boxes.push_back(BoxOf(path, fmt::format("{}: box {}", path.string(), boxes.size()), entry, tables));
    }
  } catch (const nlohmann::json::exception&) {
    throw InputError("{}: box {}: expected {}", path.string(), boxes.size(), kExpected);
  }
  return boxes;
}

// Detects the format of a file by its content.
BoxFormat FormatOf(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  if (first != std::string::npos && (text[first] == '{' || text[first] == '[')) {
    return BoxFormat::kCoco;
  }
  const std::vector<TextLine> lines = TextLinesIn(text);
  if (lines.empty()) {
    return BoxFormat::kBoxes;
  }
  const TextLine& line = lines.front();
  // A comma may stand in a label of boxes.txt, but not between its numbers.
  const auto is_number = [&](std::size_t i) { return ParseNumber<double>(line.words[i]).has_value(); };
  if (line.text.find_first_of(",;") == std::string::npos ||
      (line.words.size() >= 7 && is_number(0) && is_number(2) && is_number(3))) {
    return BoxFormat::kBoxes;
  }
  return ParseNumber<double>(SplitAt(line, ',').words.front()) ? BoxFormat::kMot : BoxFormat::kCsv;
}

}  // namespace

std::vector<FileBox> ReadBoxFile(const fs::path& path, const cv::Size& image) {
  if (fs::is_directory(path)) {
    return ReadFolder(path, image);
  }
  const std::string text = ReadFile(path, "a file with boxes");  // once: a pipe does not give it again
  switch (FormatOf(text)) {
    case BoxFormat::kCoco:
      return ReadCoco(path, text);
    case BoxFormat::kMot:
      return ReadMot(path, text);
    case BoxFormat::kCsv:
      return ReadTable(path, text, image);
    default:
      return ReadBoxes(path, text);
  }
}

}  // namespace sqslam
