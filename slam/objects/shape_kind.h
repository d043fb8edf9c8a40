#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace sqslam {

// Modes of the prior over the exponents: box, upright cylinder, ellipsoid.
enum class ShapeKind { kBox, kCylinder, kEllipsoid };
constexpr auto EnumNames(ShapeKind) { return std::array{"box", "cylinder", "ellipsoid"}; }
inline constexpr std::array kShapeKinds = {ShapeKind::kBox, ShapeKind::kCylinder, ShapeKind::kEllipsoid};

// Returns the exponents e1, e2 at the centre of a mode.
inline std::array<double, 2> ExponentsOf(ShapeKind kind) {
  constexpr double kFlat = 0.15;
  return {kind == ShapeKind::kEllipsoid ? 1.0 : kFlat, kind == ShapeKind::kBox ? kFlat : 1.0};
}

inline ShapeKind NearestKind(double e1, double e2) {
  return *std::ranges::min_element(kShapeKinds, {}, [&](ShapeKind kind) {
    const auto [a, b] = ExponentsOf(kind);
    return std::hypot(e1 - a, e2 - b);
  });
}

}  // namespace sqslam
