#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>

#include "render/gl/point_splats.h"

namespace sqslam {

// Draws points as PointSplats does, but on the CPU. A software renderer takes up to twice as long for the
// whole picture, because it draws each point as a polygon. For the sources of render/gl only.
class SplatRaster {
 public:
  // Starts an empty picture.
  void Clear(cv::Size size, const std::array<std::uint8_t, 4>& rgba);

  // Draws the vertices of these ranges. `focal`: factor on sizes in map units at distance 1, samples.
  void Draw(std::span<const PointSplats::Vertex> vertices, std::span<const PointSplats::Range> ranges,
            const PointSplats::Look& look, const Eigen::Matrix4f& T_device_map, float focal);

  // Returns RGBA (four bytes a sample) and depths in [0, 1], bottom row first.
  const cv::Mat1i& Colors() const { return colors_; }
  const cv::Mat1f& Depths() const { return depths_; }

 private:
  cv::Mat1i colors_;
  cv::Mat1f depths_;
};

}  // namespace sqslam
