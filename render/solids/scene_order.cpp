#include "render/solids/scene_order.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

namespace sqslam {
namespace {

constexpr std::size_t kMaxSolidsWithPlanes = 2000;  // two million planes, a second or two

// Order among solids that can be drawn in any order: farther first, then by position and shape.
auto Rank(const PosedSuperquadric& solid, const Eigen::Vector3d& eye) {
  const Eigen::Vector3d& c = solid.T_map_object.translation;
  const Eigen::Vector3d& a = solid.shape.half_size;
  return std::make_tuple(-(c - eye).norm(), c.x(), c.y(), c.z(), a.x(), a.y(), a.z(), solid.shape.e1,
                         solid.shape.e2);
}

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

SolidOrder::SolidOrder(std::vector<PosedSuperquadric> solids) : solids_(std::move(solids)) {
  if (solids_.size() > kMaxSolidsWithPlanes) {
    return;
  }
  for (std::size_t i = 0; i < solids_.size(); ++i) {
    for (std::size_t j = i + 1; j < solids_.size(); ++j) {
      const Separation apart = Separate(solids_[i], solids_[j]);
      planes_.push_back({i, j, apart.direction, apart.middle});
    }
  }
}

std::vector<std::size_t> SolidOrder::BackToFront(const Eigen::Vector3d& eye) const {
  const std::size_t count = solids_.size();
  std::vector<std::size_t> ranked(count);
  std::iota(ranked.begin(), ranked.end(), std::size_t{0});
  std::ranges::sort(ranked, {}, [&](std::size_t i) { return Rank(solids_[i], eye); });
  if (planes_.empty()) {
    return ranked;
  }
  std::vector<std::vector<std::size_t>> nearer(count);  // solids to draw after each
  std::vector<int> waits_for(count, 0);
  for (const Plane& plane : planes_) {
    const double side = plane.normal.dot(eye) - plane.offset;
    if (side != 0.0) {
      const auto [far, near] = side > 0.0 ? std::pair(plane.a, plane.b) : std::pair(plane.b, plane.a);
      nearer[far].push_back(near);
      ++waits_for[near];
    }
  }
  std::vector<std::size_t> order;
  while (!ranked.empty()) {
    const auto free = std::ranges::find_if(ranked, [&](std::size_t i) { return waits_for[i] == 0; });
    const auto next = free == ranked.end() ? ranked.begin() : free;  // a cycle: start with the farthest
    order.push_back(*next);
    ranked.erase(next);
    for (const std::size_t other : nearer[order.back()]) {
      --waits_for[other];
    }
  }
  return order;
}

Separation Separate(const PosedSuperquadric& a, const PosedSuperquadric& b) {
  constexpr int kMaxRounds = 40;
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
      return best;  // the usual case; else all directions count, so that swapping a and b changes nothing
    }
  }
  // Finds the point of b - a (Minkowski difference) nearest to the origin, starting at the centres'
  // difference.
  Eigen::Vector3d v = centers;
  for (int round = 0; round < kMaxRounds && best.gap < 0.0 && v.squaredNorm() > 1e-18; ++round) {
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

}  // namespace sqslam
