#include "slam/objects/isolation_forest.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "slam/util/to_vector.h"

namespace sqslam {

double MeanIsolationDepth(int n) {
  if (n < 2) {
    return 0.0;
  }
  double harmonic = 0.0;
  for (int i = 1; i < n; ++i) {
    harmonic += 1.0 / i;
  }
  return 2.0 * harmonic - 2.0 * (n - 1) / n;
}

IsolationForest::IsolationForest(std::span<const Eigen::Vector3d> points,
                                 const IsolationForestOptions& options, std::uint64_t seed) {
  const int n = static_cast<int>(points.size());
  // Half of a large cloud, two thirds of a small one: trees grown from all points are too similar.
  const int sample_size = std::min(options.max_samples, n > 100 ? n / 2 : 2 * n / 3);
  if (sample_size < 2) {
    return;
  }
  max_depth_ = static_cast<int>(std::ceil(std::log2(sample_size)));
  normalisation_ = MeanIsolationDepth(sample_size);
  std::mt19937_64 generator(seed);
  std::vector<Eigen::Vector3d> sample(points.begin(), points.end());
  for (int tree = 0; tree < options.trees; ++tree) {
    std::shuffle(sample.begin(), sample.end(), generator);
    roots_.push_back(Grow({sample.data(), static_cast<std::size_t>(sample_size)}, 0, generator));
  }
}

template <typename Generator>
int IsolationForest::Grow(std::span<Eigen::Vector3d> points, int depth, Generator& generator) {
  const int index = static_cast<int>(nodes_.size());
  nodes_.emplace_back();
  nodes_[index].depth = depth + MeanIsolationDepth(static_cast<int>(points.size()));
  if (points.size() < 2 || depth >= max_depth_) {
    return index;
  }
  std::normal_distribution<double> gaussian;
  const double x = gaussian(generator);
  const double y = gaussian(generator);
  const double z = gaussian(generator);
  const Eigen::Vector3d normal(x, y, z);
  const auto by_height = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return a.dot(normal) < b.dot(normal);
  };
  const auto [low, high] = std::minmax_element(points.begin(), points.end(), by_height);
  const double range_begin = low->dot(normal);
  const double range_end = high->dot(normal);
  if (!(range_end > range_begin)) {
    return index;
  }
  const double intercept = std::uniform_real_distribution<double>(range_begin, range_end)(generator);
  const auto middle = std::partition(points.begin(), points.end(),
                                     [&](const Eigen::Vector3d& p) { return p.dot(normal) <= intercept; });
  const auto left_size = static_cast<std::size_t>(middle - points.begin());
  const int left = Grow(points.first(left_size), depth + 1, generator);
  const int right = Grow(points.subspan(left_size), depth + 1, generator);
  nodes_[index].normal = normal;
  nodes_[index].intercept = intercept;
  nodes_[index].left = left;
  nodes_[index].right = right;
  return index;
}

double IsolationForest::Score(const Eigen::Vector3d& p) const {
  if (roots_.empty() || normalisation_ <= 0.0) {
    return 0.5;
  }
  double sum = 0.0;
  for (const int root : roots_) {
    const Node* node = &nodes_[root];
    while (node->left >= 0) {
      node = &nodes_[p.dot(node->normal) <= node->intercept ? node->left : node->right];
    }
    sum += node->depth;
  }
  return std::exp2(-sum / static_cast<double>(roots_.size()) / normalisation_);
}

std::vector<double> AnomalyScores(std::span<const Eigen::Vector3d> points,
                                  const IsolationForestOptions& options, std::uint64_t seed) {
  if (!options.enabled || static_cast<int>(points.size()) < options.min_points) {
    return {};
  }
  const IsolationForest forest(points, options, seed);
  return ToVector(points, [&](const Eigen::Vector3d& p) { return forest.Score(p); });
}

}  // namespace sqslam
