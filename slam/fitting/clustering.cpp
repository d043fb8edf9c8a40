#include "slam/fitting/clustering.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>
#include <utility>

#include "slam/util/statistics.h"

namespace sqslam {
namespace {

using Eigen::Vector3d;
using Clusters = std::vector<std::vector<std::size_t>>;

constexpr std::size_t kNeighbours = 8;
constexpr std::size_t kDenseNeighbours = 9;  // itself included
constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

// The points with the given indices, as nanoflann wants to see them.
struct View {
  const std::vector<Vector3d>& points;
  const std::vector<std::size_t>& indices;

  std::size_t kdtree_get_point_count() const { return indices.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[indices[i]][static_cast<Eigen::Index>(axis)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using Tree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, View>, View, 3, std::size_t>;
using Matches = std::vector<std::pair<std::size_t, double>>;  // index and squared distance

Matches Within(const Tree& tree, const Vector3d& point, double radius) {
  Matches matches;
  tree.radiusSearch(point.data(), radius * radius, matches, nanoflann::SearchParams());  // nearest first
  return matches;
}

double TypicalDistance(const Tree& tree, const View& view) {
  std::vector<double> squares;
  for (const std::size_t index : view.indices) {
    std::array<std::size_t, kNeighbours + 1> found{};
    std::array<double, kNeighbours + 1> square{};
    const std::size_t count =
        tree.knnSearch(view.points[index].data(), kNeighbours + 1, found.data(), square.data());
    squares.push_back(square[count - 1]);
  }
  return std::sqrt(UpperMedian(std::move(squares)));
}

}  // namespace

Clusters ClusterPoints(const std::vector<Vector3d>& points, const std::vector<std::size_t>& indices,
                       double distance) {
  if (indices.empty()) {
    return {};
  }
  const View view{points, indices};
  const Tree tree(3, view, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  const double radius = distance * TypicalDistance(tree, view);
  const auto at = [&](std::size_t i) -> const Vector3d& { return points[indices[i]]; };
  std::vector<bool> dense(indices.size());
  for (std::size_t i = 0; i < indices.size(); ++i) {
    dense[i] = Within(tree, at(i), radius).size() >= kDenseNeighbours;
  }
  Clusters clusters;
  std::vector<std::size_t> cluster_of(indices.size(), kNone);
  for (std::size_t first = 0; first < indices.size(); ++first) {
    if (!dense[first] || cluster_of[first] != kNone) {
      continue;
    }
    std::vector<std::size_t> pending = {first};
    cluster_of[first] = clusters.size();
    while (!pending.empty()) {
      const std::size_t i = pending.back();
      pending.pop_back();
      for (const auto& [j, square] : Within(tree, at(i), radius)) {
        if (dense[j] && cluster_of[j] == kNone) {
          cluster_of[j] = clusters.size();
          pending.push_back(j);
        }
      }
    }
    clusters.emplace_back();
  }
  for (std::size_t i = 0; i < indices.size(); ++i) {
    std::size_t cluster = cluster_of[i];
    if (!dense[i]) {
      const Matches matches = Within(tree, at(i), radius);
      const auto near =
          std::find_if(matches.begin(), matches.end(), [&](const auto& m) { return dense[m.first]; });
      cluster = near == matches.end() ? kNone : cluster_of[near->first];
    }
    if (cluster != kNone) {
      clusters[cluster].push_back(indices[i]);
    }
  }
  std::stable_sort(clusters.begin(), clusters.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return clusters;
}

}  // namespace sqslam
