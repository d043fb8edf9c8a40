#pragma once

#include <algorithm>
#include <cmath>

#include "slam/geometry/superquadric.h"

namespace sqslam::testing {

// 3D IoU by a regular grid over the box around both solids: plain, to stand apart from the code under test.
inline double SolidIoU(const PosedSuperquadric& a, const PosedSuperquadric& b, int samples = 48) {
  const auto bounds = [](const PosedSuperquadric& s) -> Eigen::Vector3d {
    return s.T_map_object.RotationMatrix().cwiseAbs() * s.shape.half_size;
  };
  const Eigen::Vector3d ca = a.T_map_object.translation;
  const Eigen::Vector3d cb = b.T_map_object.translation;
  if ((((ca - cb).cwiseAbs() - bounds(a) - bounds(b)).array() > 0.0).any()) {
    return 0.0;
  }
  const Eigen::Vector3d low = (ca - bounds(a)).cwiseMin(cb - bounds(b));
  const Eigen::Vector3d high = (ca + bounds(a)).cwiseMax(cb + bounds(b));
  const Rigid3d T_a = a.T_map_object.Inverse();
  const Rigid3d T_b = b.T_map_object.Inverse();
  int both = 0;
  int any = 0;
  for (int i = 0; i < samples * samples * samples; ++i) {
    const Eigen::Vector3d cell(i % samples, (i / samples) % samples, i / (samples * samples));
    const Eigen::Vector3d p = low + (high - low).cwiseProduct((cell.array() + 0.5).matrix() / samples);
    const bool in_a = a.shape.RadialScale(T_a * p) <= 1.0;
    const bool in_b = b.shape.RadialScale(T_b * p) <= 1.0;
    both += in_a && in_b ? 1 : 0;
    any += in_a || in_b ? 1 : 0;
  }
  return any > 0 ? static_cast<double>(both) / any : 0.0;
}

}  // namespace sqslam::testing
