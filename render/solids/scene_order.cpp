#include "render/solids/scene_order.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "slam/util/disjoint_sets.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr std::size_t kMostWithPlanes = 2000;  // solids: two million planes, a second or two

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
  const bool few = solids_.size() <= kMostWithPlanes;
  if (few) {
    entries_ = InterpenetratingGroups(solids_);
  }
  std::vector<int> entry_of(solids_.size(), -1);
  for (std::size_t e = 0; e < entries_.size(); ++e) {
    for (const int index : entries_[e]) {
      entry_of[static_cast<std::size_t>(index)] = static_cast<int>(e);
    }
  }
  for (std::size_t i = 0; i < solids_.size(); ++i) {
    if (entry_of[i] < 0) {
      entry_of[i] = static_cast<int>(entries_.size());
      entries_.push_back({static_cast<int>(i)});
    }
  }
  for (std::size_t i = 0; few && i < solids_.size(); ++i) {
    for (std::size_t j = i + 1; j < solids_.size(); ++j) {
      if (entry_of[i] != entry_of[j]) {
        const Separation apart = Separate(solids_[i], solids_[j]);
        planes_.push_back({entry_of[i], entry_of[j], apart.direction, apart.middle});
      }
    }
  }
}

std::vector<std::vector<int>> SolidOrder::BackToFront(const Eigen::Vector3d& eye) const {
  const std::size_t count = entries_.size();
  std::vector<int> ranked(count);
  std::iota(ranked.begin(), ranked.end(), 0);
  const auto solid = [this](int entry) -> const PosedSuperquadric& {
    return solids_[static_cast<std::size_t>(entries_[static_cast<std::size_t>(entry)].front())];
  };
  std::ranges::sort(ranked, [&](int a, int b) { return Rank(solid(a), eye) < Rank(solid(b), eye); });
  if (planes_.empty()) {
    return ToVector(ranked, [this](int entry) { return entries_[static_cast<std::size_t>(entry)]; });
  }

  // votes[a * count + b] > 0: draw a before b. Members of a group may disagree: the majority decides.
  std::vector<int> votes(count * count, 0);
  for (const Plane& plane : planes_) {
    const double side = plane.normal.dot(eye) - plane.offset;
    const int vote = side > 0.0 ? 1 : side < 0.0 ? -1 : 0;
    votes[static_cast<std::size_t>(plane.a) * count + static_cast<std::size_t>(plane.b)] += vote;
    votes[static_cast<std::size_t>(plane.b) * count + static_cast<std::size_t>(plane.a)] -= vote;
  }
  std::vector<int> waits_for(count, 0);
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = 0; b < count; ++b) {
      waits_for[b] += votes[a * count + b] > 0 ? 1 : 0;
    }
  }
  std::vector<std::vector<int>> order;
  while (!ranked.empty()) {
    const auto free = std::ranges::find_if(
        ranked, [&](int entry) { return waits_for[static_cast<std::size_t>(entry)] == 0; });
    const auto next = free == ranked.end() ? ranked.begin() : free;  // a cycle: start with the farthest
    const auto drawn = static_cast<std::size_t>(*next);
    order.push_back(entries_[drawn]);
    ranked.erase(next);
    for (std::size_t b = 0; b < count; ++b) {
      waits_for[b] -= votes[drawn * count + b] > 0 ? 1 : 0;
    }
  }
  return order;
}

Separation Separate(const PosedSuperquadric& a, const PosedSuperquadric& b) {
  constexpr int kRounds = 40;
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
  for (int round = 0; round < kRounds && best.gap < 0.0 && v.squaredNorm() > 1e-18; ++round) {
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

std::vector<std::vector<int>> InterpenetratingGroups(std::span<const PosedSuperquadric> solids) {
  constexpr double kSlack = 0.03;  // share by which solids are shrunk: mere contact does not count
  const std::size_t count = solids.size();
  std::vector<PosedSuperquadric> shrunk(solids.begin(), solids.end());
  for (PosedSuperquadric& solid : shrunk) {
    solid.shape.half_size *= 1.0 - kSlack;
  }
  DisjointSets sets(count);
  const auto root = [&sets](std::size_t i) { return sets.Root(static_cast<std::int32_t>(i)); };
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) {
      const double apart = (shrunk[i].T_map_object.translation - shrunk[j].T_map_object.translation).norm();
      const double reach = shrunk[i].shape.half_size.norm() + shrunk[j].shape.half_size.norm();
      if (apart < reach && Separate(shrunk[i], shrunk[j]).gap < 0.0) {
        const auto [a, b] = std::pair(root(i), root(j));
        sets.Join(std::max(a, b), std::min(a, b));
      }
    }
  }
  std::vector<std::vector<int>> of_root(count);
  for (std::size_t i = 0; i < count; ++i) {
    of_root[static_cast<std::size_t>(root(i))].push_back(static_cast<int>(i));
  }
  std::erase_if(of_root, [](const std::vector<int>& group) { return group.size() < 2; });
  return of_root;
}

}  // namespace sqslam
