#include "slam/io/coco_masks.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "slam/util/limits.h"
#include "slam/util/throw_if.h"

namespace sqslam {
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

}  // namespace sqslam
