#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "render/gl/point_splats.h"

namespace sqslam {

// A point in the picture; samples from the lower left.
struct SplatDisc {
  float x = 0.0F;
  float y = 0.0F;
  float depth = 0.0F;
  float diameter = 0.0F;
  std::int32_t rgba = 0;
};

// Draws points as PointSplats does, with the processor alone. A software renderer takes several times as
// long: to it each point is a polygon of its own. For the sources of render/gl only.
class SplatRaster {
 public:
  // Begins an empty picture.
  void Clear(cv::Size size, const std::array<std::uint8_t, 4>& rgba);

  // Draws the vertices of these ranges. `focal`: factor on sizes in map units at distance 1, samples.
  void Draw(std::span<const PointSplats::Vertex> vertices, std::span<const PointSplats::Range> ranges,
            const PointSplats::Look& look, const Eigen::Matrix4f& T_device_map, float focal);

  // Returns the picture, four bytes RGBA a sample and the first row at the bottom, and for each sample its
  // depth from 0 to 1.
  const cv::Mat1i& Colors() const { return colors_; }
  const cv::Mat1f& Depths() const { return depths_; }

 private:
  // Appends the discs of these vertices that are in the picture.
  void Place(std::span<const PointSplats::Vertex> vertices, float least_size, const PointSplats::Look& look,
             const Eigen::Matrix4f& T_device_map, float focal, std::vector<SplatDisc>& discs) const;

  cv::Mat1i colors_;
  cv::Mat1f depths_;
  std::vector<std::vector<SplatDisc>> discs_;  // in parts that are placed side by side
};

}  // namespace sqslam
