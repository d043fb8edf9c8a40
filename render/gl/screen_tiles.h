#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace sqslam {

// Contents of a tile of a picture; each may come with those before it.
enum class TileContent : std::uint8_t {
  kBackground,
  kFlat,  // drawn without depth: grid and shadow
  kDeep,  // points and lines
  kNearSolid,
};

// Notes what square tiles of a picture show, to draw what is costly only where it matters. All places are
// pixels from the lower left. For the sources of render/gl only.
class ScreenTiles {
 public:
  static constexpr int kSide = 16;  // pixels of the picture

  explicit ScreenTiles(cv::Size picture);

  // Mark all tiles that a part of the picture, or a line with this margin on each side, touches.
  void Mark(const Eigen::AlignedBox2d& part, TileContent content);
  void MarkLine(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double margin, TileContent content);
  // Marks all tiles that points touch or come next to. `depths`: of a picture with 1 or more samples a pixel
  // along each side, 1 where there is none.
  void MarkPoints(const cv::Mat1f& depths, int samples, TileContent content);

  // Returns rectangles that together are the tiles with a content from `first` to `last`. `step`: pixels of
  // the picture per pixel of the target that they are for; divides kSide.
  std::vector<cv::Rect> Areas(TileContent first, TileContent last, int step = 1) const;

 private:
  cv::Size picture_;
  cv::Size tiles_;
  std::vector<TileContent> contents_;  // row by row
};

// Returns a part of the picture that holds all that is seen of a box, pixels from the lower left.
// `T_device_box`: to OpenGL's clip coordinates.
Eigen::AlignedBox2d SeenPart(const Eigen::AlignedBox3d& box, const Eigen::Matrix4d& T_device_box,
                             cv::Size picture);

}  // namespace sqslam
