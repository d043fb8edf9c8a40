#include "render/gl/screen_tiles.h"

#include <algorithm>
#include <cmath>

namespace sqslam {

ScreenTiles::ScreenTiles(cv::Size picture)
    : picture_(picture),
      tiles_((picture.width + kSide - 1) / kSide, (picture.height + kSide - 1) / kSide),
      contents_(static_cast<std::size_t>(tiles_.area())) {}

void ScreenTiles::Mark(const Eigen::AlignedBox2d& part, TileContent content) {
  const auto tile = [](double pixel, int tiles) {
    return static_cast<int>(std::clamp(std::floor(pixel / kSide), -1.0, static_cast<double>(tiles)));
  };
  const cv::Point first(tile(part.min().x(), tiles_.width), tile(part.min().y(), tiles_.height));
  const cv::Point last(tile(part.max().x(), tiles_.width), tile(part.max().y(), tiles_.height));
  for (int y = std::max(first.y, 0); y <= std::min(last.y, tiles_.height - 1); ++y) {
    for (int x = std::max(first.x, 0); x <= std::min(last.x, tiles_.width - 1); ++x) {
      TileContent& tile_content = contents_[static_cast<std::size_t>(y * tiles_.width + x)];
      tile_content = std::max(tile_content, content);
    }
  }
}

// Marks the boxes of pieces no longer than a tile's side; of a line far beyond the picture the box of all of
// it.
void ScreenTiles::MarkLine(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double margin,
                           TileContent content) {
  const double length = (to - from).lpNorm<Eigen::Infinity>();
  const bool inside = length < 2.0 * (picture_.width + picture_.height);
  const int pieces = inside ? static_cast<int>(length / kSide) + 1 : 1;
  for (int i = 0; i < pieces; ++i) {
    Eigen::AlignedBox2d box(Eigen::Vector2d(from + (to - from) * i / pieces));
    box.extend(from + (to - from) * (i + 1) / pieces);
    Mark({box.min().array() - margin, box.max().array() + margin}, content);
  }
}

void ScreenTiles::MarkPoints(const cv::Mat1f& depths, int samples, TileContent content) {
  const int side = samples * kSide;
  for (int y = 0; y < tiles_.height; ++y) {
    for (int x = 0; x < tiles_.width; ++x) {
      const cv::Rect around(side * x - samples, side * y - samples, side + 2 * samples, side + 2 * samples);
      const cv::Mat1f part = depths(around & cv::Rect({}, depths.size()));
      bool any = false;
      for (int row = 0; row < part.rows && !any; ++row) {
        any = std::any_of(part[row], part[row] + part.cols, [](float depth) { return depth < 1.0F; });
      }
      TileContent& tile = contents_[static_cast<std::size_t>(y * tiles_.width + x)];
      tile = any ? std::max(tile, content) : tile;
    }
  }
}

// Runs of tiles in a row; a run with the same ends as one in the row below prolongs it.
std::vector<cv::Rect> ScreenTiles::Areas(TileContent first, TileContent last, int step) const {
  const auto wanted = [&](TileContent content) { return first <= content && content <= last; };
  std::vector<cv::Rect> areas;  // in tiles
  for (int y = 0; y < tiles_.height; ++y) {
    const auto row = contents_.begin() + y * tiles_.width;
    const auto row_end = row + tiles_.width;
    for (auto at = std::find_if(row, row_end, wanted); at != row_end;) {
      const auto end = std::find_if_not(at, row_end, wanted);
      const cv::Rect run(static_cast<int>(at - row), y, static_cast<int>(end - at), 1);
      const auto below = std::ranges::find_if(areas, [&](const cv::Rect& area) {
        return area.x == run.x && area.width == run.width && area.y + area.height == y;
      });
      if (below != areas.end()) {
        ++below->height;
      } else {
        areas.push_back(run);
      }
      at = std::find_if(end, row_end, wanted);
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
