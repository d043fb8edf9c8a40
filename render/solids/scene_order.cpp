#include "render/solids/scene_order.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

#include "render/solids/convex_solids.h"

namespace sqslam {
namespace {

// Tells solids apart that can be drawn in either order: farther first, then by where and how large.
auto Rank(const PosedSuperquadric& solid, const Eigen::Vector3d& eye) {
  const Eigen::Vector3d& c = solid.T_map_object.translation;
  const Eigen::Vector3d& a = solid.shape.half_size;
  return std::make_tuple(-(c - eye).norm(), c.x(), c.y(), c.z(), a.x(), a.y(), a.z(), solid.shape.e1,
                         solid.shape.e2);
}

}  // namespace

SolidOrder::SolidOrder(std::vector<PosedSuperquadric> solids)
    : solids_(std::move(solids)), entries_(InterpenetratingGroups(solids_)) {
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
  for (std::size_t i = 0; i < solids_.size(); ++i) {
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
  std::sort(ranked.begin(), ranked.end(),
            [&](int a, int b) { return Rank(solid(a), eye) < Rank(solid(b), eye); });

  // votes[a * count + b] > 0: a is to be drawn before b. A group's members may disagree: the majority counts.
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
    const auto free = std::find_if(ranked.begin(), ranked.end(), [&](int entry) {
      return waits_for[static_cast<std::size_t>(entry)] == 0;
    });
    const auto next = free == ranked.end() ? ranked.begin() : free;  // a ring: start with the farthest
    const auto drawn = static_cast<std::size_t>(*next);
    order.push_back(entries_[drawn]);
    ranked.erase(next);
    for (std::size_t b = 0; b < count; ++b) {
      waits_for[b] -= votes[drawn * count + b] > 0 ? 1 : 0;
    }
  }
  return order;
}

}  // namespace sqslam
