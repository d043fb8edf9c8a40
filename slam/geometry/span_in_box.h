#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>

namespace sqslam {

// The part of a line start + t direction that lies in a solid.
struct LineSpan {
  double begin = 0.0;  // t
  double end = 0.0;
  int axis = -1;  // normal of the face through which it enters a box; -1: it begins within
};

// Returns the part with t in [begin, end] that lies in the box from `low` to `high`; empty if it misses the
// box.
template <typename Vector>
std::optional<LineSpan> SpanInBox(const Vector& start, const Vector& direction, const Vector& low,
                                  const Vector& high, double end, double begin = 0.0) {
  int axis = -1;
  for (int i = 0; i < static_cast<int>(start.size()); ++i) {
    if (std::abs(direction[i]) < 1e-12) {
      if (start[i] < low[i] || start[i] > high[i]) {
        return std::nullopt;
      }
      continue;
    }
    const double a = (low[i] - start[i]) / direction[i];
    const double b = (high[i] - start[i]) / direction[i];
    if (std::min(a, b) > begin) {
      begin = std::min(a, b);
      axis = i;
    }
    end = std::min(end, std::max(a, b));
  }
  return begin < end ? std::optional(LineSpan{begin, end, axis}) : std::nullopt;
}

}  // namespace sqslam
