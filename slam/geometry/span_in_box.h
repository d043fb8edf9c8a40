#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace sqslam {

// Returns the first and the last t in [0, end] for which start + t direction lies in the box from `low` to
// `high`; empty if the segment misses the box.
template <typename Vector>
std::optional<std::array<double, 2>> SpanInBox(const Vector& start, const Vector& direction,
                                               const Vector& low, const Vector& high, double end) {
  double begin = 0.0;
  for (int i = 0; i < static_cast<int>(start.size()); ++i) {
    if (std::abs(direction[i]) < 1e-12) {
      if (start[i] < low[i] || start[i] > high[i]) {
        return std::nullopt;
      }
      continue;
    }
    const double a = (low[i] - start[i]) / direction[i];
    const double b = (high[i] - start[i]) / direction[i];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  return begin < end ? std::optional(std::array{begin, end}) : std::nullopt;
}

}  // namespace sqslam
