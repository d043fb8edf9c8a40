#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>

namespace sqslam {

// A picture of at most 256 colours.
struct PaletteImage {
  cv::Mat1b index;
  std::array<std::uint32_t, 256> argb{};  // opaque
};

// Chooses the colours by median cut (Heckbert, "Color image quantization for frame buffer display", 1982) and
// gives each pixel (8UC3, BGR) the one of its part of the colour cube.
PaletteImage ReduceColors(const cv::Mat& bgr);

}  // namespace sqslam
