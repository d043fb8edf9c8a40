#include "render/solids/convex_solids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace sqslam {
namespace {

Separation Along(const PosedSuperquadric& a, const PosedSuperquadric& b, Eigen::Vector3d n) {
  n.normalize();
  if (n.dot(b.T_map_object.translation - a.T_map_object.translation) < 0.0) {
    n = -n;
  }
  const double top_of_a = n.dot(a.T_map_object.translation) + SupportExtent(a, n);
  const double bottom_of_b = n.dot(b.T_map_object.translation) - SupportExtent(b, n);
  return {n, bottom_of_b - top_of_a, 0.5 * (top_of_a + bottom_of_b)};
}

}  // namespace

Separation Separate(const PosedSuperquadric& a, const PosedSuperquadric& b, int rounds) {
  const Eigen::Matrix3d axes_a = a.T_map_object.RotationMatrix();
  const Eigen::Matrix3d axes_b = b.T_map_object.RotationMatrix();
  const Eigen::Vector3d centers = b.T_map_object.translation - a.T_map_object.translation;
  const std::array<Eigen::Vector3d, 7> directions = {
      centers, axes_a.col(0), axes_a.col(1), axes_a.col(2), axes_b.col(0), axes_b.col(1), axes_b.col(2)};
  Separation best;
  best.gap = -std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& n : directions) {
    if (n.squaredNorm() >= 1e-18) {
      const Separation along = Along(a, b, n);
      best = along.gap > best.gap ? along : best;
    }
    if (best.gap > 0.0 && n == centers) {
      return best;  // the usual case; the others are all tried, so that swapping a and b changes nothing
    }
  }
  // The point of b - a (Minkowski difference) nearest to the origin, from centre to centre.
  Eigen::Vector3d v = centers;
  for (int round = 0; round < rounds && best.gap < 0.0 && v.squaredNorm() > 1e-18; ++round) {
    const Eigen::Vector3d w = SupportPoint(b, -v) - SupportPoint(a, v);
    const Eigen::Vector3d step = w - v;
    if (step.squaredNorm() < 1e-18) {
      break;
    }
    v += std::clamp(-v.dot(step) / step.squaredNorm(), 0.0, 1.0) * step;
    if (v.squaredNorm() > 1e-18) {
      const Separation along = Along(a, b, v);
      best = along.gap > best.gap ? along : best;
    }
  }
  return best;
}

std::vector<std::vector<int>> InterpenetratingGroups(std::span<const PosedSuperquadric> solids,
                                                     double slack) {
  const std::size_t count = solids.size();
  std::vector<PosedSuperquadric> shrunk(solids.begin(), solids.end());
  for (PosedSuperquadric& solid : shrunk) {
    solid.shape.half_size *= 1.0 - slack;
  }
  std::vector<std::size_t> root(count);
  std::iota(root.begin(), root.end(), std::size_t{0});
  const auto find = [&root](std::size_t i) {
    while (root[i] != i) {
      i = root[i];
    }
    return i;
  };
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) {
      const double apart = (shrunk[i].T_map_object.translation - shrunk[j].T_map_object.translation).norm();
      const double reach = shrunk[i].shape.half_size.norm() + shrunk[j].shape.half_size.norm();
      if (apart < reach && Separate(shrunk[i], shrunk[j]).gap < 0.0) {
        const std::size_t a = find(i);
        const std::size_t b = find(j);
        root[std::max(a, b)] = std::min(a, b);
      }
    }
  }
  std::vector<std::vector<int>> of_root(count);
  for (std::size_t i = 0; i < count; ++i) {
    of_root[find(i)].push_back(static_cast<int>(i));
  }
  std::erase_if(of_root, [](const std::vector<int>& group) { return group.size() < 2; });
  return of_root;
}

}  // namespace sqslam
