#include "slam/io/box_formats.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "slam/io/box_tables.h"
#include "slam/util/json_file.h"
#include "slam/util/limits.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

// ---- COCO

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
      ThrowIf<InputError>(
          group < 0 || group > 0x3f || shift > kMaxBits,
          "{}: the run lengths of its mask are broken, expected counts as pycocotools writes them", place);
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
                        "{}: the runs of its mask do not fit an image of {}x{}", place, width, height);
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

// COCO's category ids go up to 90 and skip these.
constexpr std::array kCocoGaps = {12, 26, 29, 30, 45, 66, 68, 69, 71, 83};

std::string CocoName(std::int64_t category) {
  const auto gaps = std::ranges::count_if(kCocoGaps, [&](int gap) { return gap <= category; });
  return category < 1 || std::ranges::count(kCocoGaps, category) > 0 ? fmt::format("class_{}", category)
                                                                     : CocoClassName(category - 1 - gaps);
}

struct CocoTables {
  std::map<std::int64_t, std::string> images;  // file names
  std::map<std::int64_t, std::string> categories;
};

// Segmenters often write no box beside a mask.
Box2d CocoBounds(const Json& entry, const std::string& place) {
  if (!entry.contains("bbox") && entry.contains("segmentation")) {
    return BoundsOfMask(entry.at("segmentation"), place);
  }
  const Json& corners = entry.at("bbox");
  return {corners.at(0).get<double>(), corners.at(1).get<double>(), corners.at(2).get<double>(),
          corners.at(3).get<double>()};
}

FileBox BoxOf(std::string place, const Json& entry, const CocoTables& tables) {
  const Box2d box = CocoBounds(entry, place);
  ThrowIf<InputError>(!(box.width > 0.0) || !(box.height > 0.0),
                      "{}: expected a bbox [x, y, w, h] with w and h above 0, or a mask that is not empty",
                      place);
  const auto category = entry.at("category_id").get<std::int64_t>();
  const auto name = tables.categories.find(category);
  const std::string label = name != tables.categories.end() ? name->second : CocoName(category);
  FrameKey frame = std::string();
  if (const Json& id = entry.at("image_id"); id.is_string()) {
    frame = id.get<std::string>();
  } else if (tables.images.empty()) {
    frame = ImageNumber{id.get<std::int64_t>()};
  } else if (const auto image = tables.images.find(id.get<std::int64_t>()); image != tables.images.end()) {
    frame = image->second;
  } else {
    throw InputError("{}: image_id {} is not among the images", place, id.get<std::int64_t>());
  }
  const Json score = entry.value("score", Json());
  const bool scored = !score.is_null() && score.get<double>() != -1.0;
  const Detection detection{LabelFrom(place, label), scored ? score.get<double>() : 1.0, box};
  return {std::move(place), std::move(frame), detection};
}

std::vector<FileBox> ReadCoco(const fs::path& path, const std::string& text) {
  constexpr const char* kExpected =
      "COCO's annotations or results: image_id, category_id, bbox [x, y, w, h] and a score for each box";
  const Json document = ParseJson(path, text, kExpected);
  std::vector<FileBox> boxes;
  try {
    CocoTables tables;
    if (document.is_object()) {
      for (const Json& image : document.value("images", Json::array())) {
        tables.images[image.at("id").get<std::int64_t>()] = image.at("file_name").get<std::string>();
      }
      for (const Json& category : document.value("categories", Json::array())) {
        tables.categories[category.at("id").get<std::int64_t>()] = category.at("name").get<std::string>();
      }
    }
    const Json& entries = document.is_object() ? document.at("annotations") : document;
    for (const Json& entry : entries) {
      boxes.push_back(BoxOf(fmt::format("{}: box {}", path.string(), boxes.size()), entry, tables));
    }
  } catch (const nlohmann::json::exception&) {
    throw InputError("{}: box {}: expected {}", path.string(), boxes.size(), kExpected);
  }
  return boxes;
}

}  // namespace

std::vector<FileBox> ReadBoxFile(const fs::path& path) {
  if (fs::is_directory(path)) {
    return ReadBoxFolder(path);
  }
  const std::string text = ReadText(path, "a file with boxes");  // once: a pipe does not give it again
  const std::size_t first = text.find_first_not_of(" \t\n");
  if (first != std::string::npos && (text[first] == '{' || text[first] == '[')) {
    return ReadCoco(path, text);
  }
  switch (FormatOfBoxLines(text)) {
    case BoxFormat::kMot:
      return ReadMot(path, text);
    case BoxFormat::kCsv:
      return ReadBoxTable(path, text);
    default:
      return ReadBoxLines(path, text);
  }
}

}  // namespace sqslam
