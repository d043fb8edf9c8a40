#include "render/scene_order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

namespace sqslam {
namespace {

// +1 where b may cover a (draw a first), -1 the other way round, 0 where neither can.
int DrawOrder(const PosedSuperquadric& a, const PosedSuperquadric& b, const Eigen::Vector3d& eye) {
  const Eigen::Vector3d& center_a = a.T_map_object.translation;
  const Eigen::Vector3d& center_b = b.T_map_object.translation;
  const Eigen::Matrix3d axes_a = a.T_map_object.RotationMatrix();
  const Eigen::Matrix3d axes_b = b.T_map_object.RotationMatrix();
  const std::array<Eigen::Vector3d, 7> directions = {center_b - center_a, axes_a.col(0), axes_a.col(1),
                                                     axes_a.col(2),       axes_b.col(0), axes_b.col(1),
                                                     axes_b.col(2)};
  double best_gap = -std::numeric_limits<double>::infinity();
  double eye_side = 0.0;
  for (Eigen::Vector3d n : directions) {
    if (n.squaredNorm() < 1e-18) {
      continue;
    }
    n.normalize();
    if (n.dot(center_b - center_a) < 0.0) {
      n = -n;
    }
    const double top_of_a = n.dot(center_a) + SupportExtent(a, n);
    const double bottom_of_b = n.dot(center_b) - SupportExtent(b, n);
    if (bottom_of_b - top_of_a > best_gap) {
      best_gap = bottom_of_b - top_of_a;
      eye_side = n.dot(eye) - 0.5 * (top_of_a + bottom_of_b);
    }
  }
  return eye_side > 0.0 ? 1 : eye_side < 0.0 ? -1 : 0;
}

// What tells solids apart that can be drawn in either order: farther first, then by where and how large.
auto Rank(const PosedSuperquadric& solid, const Eigen::Vector3d& eye) {
  const Eigen::Vector3d& c = solid.T_map_object.translation;
  const Eigen::Vector3d& a = solid.shape.half_size;
  return std::make_tuple(-(c - eye).norm(), c.x(), c.y(), c.z(), a.x(), a.y(), a.z(), solid.shape.e1,
                         solid.shape.e2);
}

}  // namespace

double SupportExtent(const PosedSuperquadric& solid, const Eigen::Vector3d& n) {
  const Superquadric& shape = solid.shape;
  const Eigen::Vector3d m =
      shape.half_size.cwiseProduct(solid.T_map_object.rotation.conjugate() * n).cwiseAbs();
  const auto dual = [](double u, double v, double e) {
    const double largest = std::max(u, v);
    if (largest <= 0.0) {
      return 0.0;
    }
    const double q = 2.0 / (2.0 - e);
    return largest * std::pow(std::pow(u / largest, q) + std::pow(v / largest, q), 1.0 / q);
  };
  return dual(dual(m.x(), m.y(), shape.e2), m.z(), shape.e1);
}

std::vector<int> BackToFront(const std::vector<PosedSuperquadric>& solids,
                             const Eigen::Vector3d& camera_position) {
  const std::size_t count = solids.size();
  std::vector<int> ranked(count);
  std::iota(ranked.begin(), ranked.end(), 0);
  std::sort(ranked.begin(), ranked.end(), [&](int a, int b) {
    return Rank(solids[static_cast<std::size_t>(a)], camera_position) <
           Rank(solids[static_cast<std::size_t>(b)], camera_position);
  });
  // before[i][j]: the i-th of `ranked` must be drawn before the j-th.
  std::vector<std::vector<bool>> before(count, std::vector<bool>(count, false));
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) {
      const int order = DrawOrder(solids[static_cast<std::size_t>(ranked[i])],
                                  solids[static_cast<std::size_t>(ranked[j])], camera_position);
      before[i][j] = order > 0;
      before[j][i] = order < 0;
    }
  }
  std::vector<int> order;
  std::vector<bool> drawn(count, false);
  while (order.size() < count) {
    std::size_t next = count;
    std::size_t farthest_left = count;
    for (std::size_t j = 0; j < count && next == count; ++j) {
      if (drawn[j]) {
        continue;
      }
      farthest_left = std::min(farthest_left, j);
      bool free = true;
      for (std::size_t i = 0; i < count && free; ++i) {
        free = drawn[i] || !before[i][j];
      }
      next = free ? j : count;
    }
    next = next == count ? farthest_left : next;  // a ring of solids: start with the farthest
    drawn[next] = true;
    order.push_back(ranked[next]);
  }
  return order;
}

}  // namespace sqslam
