#pragma once

#include <array>
#include <cmath>
#include <optional>

namespace sqslam {

// Prior over the size and the proportions of an object's hull; wide by default.
struct SizePrior {
  double log_width_ratio = 0.0;   // natural logarithm of the longer horizontal size over the shorter, >= 0
  double log_height_ratio = 0.0;  // of the height over the geometric mean of the horizontal sizes
  double width_sigma = 1.0;       // standard deviation of log_width_ratio
  double height_sigma = 1.5;
  std::optional<double> log_metres;  // logarithm of the geometric mean of the full sizes; empty: any size
  double size_sigma = 0.0;           // standard deviation of log_metres
};

// A size as configs/classes.yaml states it.
struct TypicalSize {
  std::array<double, 3> size = {0.0, 0.0, 0.0};  // width, depth and height, metres
  double spread = 0.4;                           // standard deviation of the logarithm of the size as a whole
  std::array<double, 2> aspect = {0.3, 0.3};  // and of the logarithms of width to depth and of height to plan

  void VisitFields(auto&& visit) {
    visit("size", size, 1e-4, 100.0);
    visit("spread", spread, 0.01, 10.0);
    visit("aspect", aspect, 0.01, 10.0);
  }

  SizePrior Prior() const {
    const auto& [width, depth, height] = size;
    const double log_area = std::log(width) + std::log(depth);
    return {std::abs(std::log(width / depth)),
            std::log(height) - 0.5 * log_area,
            aspect[0],
            aspect[1],
            (log_area + std::log(height)) / 3.0,
            spread};
  }
};

}  // namespace sqslam
