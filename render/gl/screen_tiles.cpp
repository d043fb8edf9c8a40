#include "render/gl/screen_tiles.h"

#include <algorithm>
#include <cmath>

namespace sqslam {

ScreenTiles::ScreenTiles(cv::Size picture)
    : picture_(picture),
      tiles_((picture.width + kSide - 1) / kSide, (picture.height + kSide - 1) / kSide),
      marked_(static_cast<std::size_t>(tiles_.area())) {}

void ScreenTiles::Mark(const Eigen::AlignedBox2d& pixels) {
  const auto tile = [](double pixel, int tiles) {
    return static_cast<int>(std::clamp(std::floor(pixel / kSide), -1.0, static_cast<double>(tiles)));
  };
  const int first = std::max(tile(pixels.min().x(), tiles_.width), 0);
  const int last = std::min(tile(pixels.max().x(), tiles_.width), tiles_.width - 1);
  for (int y = std::max(tile(pixels.min().y(), tiles_.height), 0);
       y <= std::min(tile(pixels.max().y(), tiles_.height), tiles_.height - 1); ++y) {
    for (int x = first; x <= last; ++x) {
      marked_[static_cast<std::size_t>(y * tiles_.width + x)] = true;
    }
  }
}

// Runs of tiles in a row; a run with the same ends as one in the row below prolongs it.
std::vector<cv::Rect> ScreenTiles::Areas(bool marked, int step) const {
  std::vector<cv::Rect> areas;  // in tiles
  for (int y = 0; y < tiles_.height; ++y) {
    for (int x = 0; x < tiles_.width;) {
      const auto row = marked_.begin() + y * tiles_.width;
      const int first = static_cast<int>(std::find(row + x, row + tiles_.width, marked) - row);
      const int end = static_cast<int>(std::find(row + first, row + tiles_.width, !marked) - row);
      const auto below = std::ranges::find_if(areas, [&](const cv::Rect& area) {
        return area.x == first && area.width == end - first && area.y + area.height == y;
      });
      if (below != areas.end()) {
        ++below->height;
      } else if (first < end) {
        areas.emplace_back(first, y, end - first, 1);
      }
      x = end;
    }
  }
  const int side = kSide / step;
  const cv::Rect target(0, 0, (picture_.width + step - 1) / step, (picture_.height + step - 1) / step);
  for (cv::Rect& area : areas) {
    area = cv::Rect(side * area.x, side * area.y, side * area.width, side * area.height) & target;
  }
  return areas;
}

Eigen::AlignedBox2d SeenPart(const Eigen::AlignedBox3d& box, const Eigen::Matrix4d& T_device_box,
                             cv::Size picture) {
  const Eigen::Vector2d size(picture.width, picture.height);
  Eigen::AlignedBox2d seen;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
    const Eigen::Vector4d device = T_device_box * corner.homogeneous();
    if (device.z() <= -device.w()) {  // before the near plane: what is left of the box ends elsewhere
      return {Eigen::Vector2d::Zero(), size};
    }
    seen.extend((0.5 * (device.head<2>() / device.w()).array() + 0.5).matrix().cwiseProduct(size));
  }
  return seen;
}

}  // namespace sqslam
