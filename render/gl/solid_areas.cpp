#include "render/gl/solid_areas.h"

namespace sqslam {
namespace {

constexpr int kTile = 16;  // side, pixels

// Returns the part of the picture that a box may occupy.
Eigen::AlignedBox2d SeenPart(const ClipBox& solid, const Eigen::Vector2d& picture) {
  Eigen::AlignedBox2d seen;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner = solid.box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
    const Eigen::Vector4d clip = solid.T_clip_box * corner.homogeneous();
    if (clip.z() <= -clip.w()) {  // before the near plane: the rest of the box may be anywhere
      return {Eigen::Vector2d::Zero(), picture};
    }
    seen.extend((0.5 * (clip.head<2>() / clip.w()).array() + 0.5).matrix().cwiseProduct(picture));
  }
  return seen;
}

}  // namespace

SolidAreas FindSolidAreas(std::span<const ClipBox> solids, cv::Size picture, double margin) {
  const Eigen::Vector2d size(picture.width, picture.height);
  cv::Mat1b near((picture.height + kTile - 1) / kTile, (picture.width + kTile - 1) / kTile, uchar{0});
  for (const ClipBox& solid : solids) {
    const Eigen::AlignedBox2d seen = SeenPart(solid, size);
    const auto tile = [&](const Eigen::Vector2d& pixel) -> cv::Point {
      const Eigen::Vector2i at = (pixel.cwiseMax(-1.0).cwiseMin(size) / kTile).array().floor().cast<int>();
      return {at.x(), at.y()};
    };
    const cv::Rect tiles(tile((seen.min().array() - margin).matrix()),
                         tile((seen.max().array() + margin).matrix()) + cv::Point(1, 1));
    near(tiles & cv::Rect({}, near.size())).setTo(1);
  }
  SolidAreas areas;
  for (int row = 0; row < near.rows; ++row) {
    for (int first = 0, end = 0; first < near.cols; first = end) {
      while (end < near.cols && near(row, end) == near(row, first)) {
        ++end;
      }
      const cv::Rect run(kTile * first, kTile * row, kTile * (end - first), kTile);
      (near(row, first) != 0 ? areas.near_solids : areas.elsewhere).push_back(run & cv::Rect({}, picture));
    }
  }
  return areas;
}

}  // namespace sqslam
