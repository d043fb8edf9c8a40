#include "slam/recognition/word_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/core/hal/hal.hpp>
#include <queue>
#include <random>
#include <stdexcept>
#include <utility>

namespace sqslam {
namespace {

// k-means++ (Arthur & Vassilvitskii 2007): draws each further centre with a probability proportional to its
// squared distance from the nearest centre so far. Returns fewer than `count` if there are too few different
// descriptors. Integer arithmetic throughout, so that every machine draws the same.
std::vector<DescriptorBits> DrawCenters(const std::vector<DescriptorBits>& descriptors, int count,
                                        std::mt19937_64& random) {
  std::vector<DescriptorBits> centers = {descriptors[random() % descriptors.size()]};
  std::vector<int> distances(descriptors.size(), 257);
  const auto weight = [&](std::size_t i) {
    return std::uint64_t(distances[i]) * std::uint64_t(distances[i]);
  };
  while (static_cast<int>(centers.size()) < count) {
    std::uint64_t total = 0;
    for (std::size_t i = 0; i < descriptors.size(); ++i) {
      distances[i] = std::min(distances[i], FindNearest({&centers.back(), 1}, descriptors[i]).distance);
      total += weight(i);
    }
    if (total == 0) {
      break;
    }
    std::uint64_t left = random() % total;
    std::size_t drawn = 0;
    for (; left >= weight(drawn); ++drawn) {
      left -= weight(drawn);
    }
    centers.push_back(descriptors[drawn]);
  }
  return centers;
}

struct Cluster {
  DescriptorBits center;
  std::vector<DescriptorBits> members;
};

// Returns at least two non-empty clusters, or none if all descriptors are equal.
std::vector<Cluster> SplitIntoClusters(std::vector<DescriptorBits> descriptors,
                                       const VocabularyOptions& options, std::mt19937_64& random) {
  std::vector<DescriptorBits> centers = DrawCenters(descriptors, options.branching, random);
  if (centers.size() < 2) {
    return {};
  }
  std::vector<Cluster> clusters;
  bool moved = true;
  for (int iteration = 0; iteration < options.iterations && moved; ++iteration) {
    clusters.assign(centers.size(), {});
    for (const DescriptorBits& descriptor : descriptors) {
      clusters[FindNearest(centers, descriptor).index].members.push_back(descriptor);
    }
    descriptors.clear();
    moved = false;
    for (std::size_t c = 0; c < centers.size(); ++c) {
      const std::vector<DescriptorBits>& members = clusters[c].members;
      descriptors.insert(descriptors.end(), members.begin(), members.end());
      clusters[c].center = members.empty() ? centers[c] : MajorityOf(members);
      moved = moved || clusters[c].center != centers[c];
      centers[c] = clusters[c].center;
    }
  }
  std::erase_if(clusters, [](const Cluster& cluster) { return cluster.members.empty(); });
  return clusters.size() < 2 ? std::vector<Cluster>{} : clusters;
}

}  // namespace

WordTree::WordTree(std::vector<std::uint8_t> child_counts, std::vector<DescriptorBits> centers)
    : child_counts_(std::move(child_counts)), centers_(std::move(centers)) {
  const std::size_t count = child_counts_.size();
  if (count == 0 || centers_.size() != count) {
    throw std::invalid_argument(fmt::format("{} nodes with {} centres", count, centers_.size()));
  }
  first_children_.resize(count);
  word_of_node_.resize(count);
  std::vector<int> levels(count, 0);
  std::size_t next = 1;  // the first node without a parent yet
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t children = child_counts_[i];
    if (i >= next) {
      throw std::invalid_argument(fmt::format("node {} has no parent", i));
    }
    if (children > count - next) {
      throw std::invalid_argument(fmt::format("node {} has children beyond the last node", i));
    }
    first_children_[i] = static_cast<NodeId>(next);
    for (std::size_t child = next; child < next + children; ++child) {
      levels[child] = levels[i] + 1;
    }
    next += children;
    depth_ = std::max(depth_, levels[i]);
    if (children == 0) {
      word_of_node_[i] = static_cast<WordId>(words_++);
    }
  }
}

WordId WordTree::WordOf(const DescriptorBits& descriptor) const {
  std::size_t node = 0;
  while (child_counts_[node] > 0) {
    const std::size_t first = first_children_[node];
    const std::span<const DescriptorBits> children(centers_.data() + first, child_counts_[node]);
    node = first + static_cast<std::size_t>(FindNearest(children, descriptor).index);
  }
  return word_of_node_[node];
}

WordTree WordTree::Train(std::vector<DescriptorBits> descriptors, const VocabularyOptions& options,
                         const TrainingProgress& progress) {
  struct Node {
    std::vector<DescriptorBits> descriptors;
    int level = 0;
  };
  std::mt19937_64 random(options.seed);
  std::vector<std::uint8_t> child_counts;
  std::vector<DescriptorBits> centers = {DescriptorBits{}};
  const double work = static_cast<double>(descriptors.size()) * options.depth;
  double done = 0.0;
  std::queue<Node> nodes;
  for (nodes.push({std::move(descriptors), 0}); !nodes.empty(); nodes.pop()) {
    auto& [members, level] = nodes.front();
    const auto size = static_cast<double>(members.size());
    std::vector<Cluster> clusters;
    if (level < options.depth && members.size() > 1) {
      clusters = SplitIntoClusters(std::move(members), options, random);
    }
    for (Cluster& cluster : clusters) {
      nodes.push({std::move(cluster.members), level + 1});
      centers.push_back(cluster.center);
    }
    child_counts.push_back(static_cast<std::uint8_t>(clusters.size()));
    done += size * (clusters.empty() ? options.depth - level : 1);
    if (progress && work > 0.0) {
      progress(done / work);
    }
  }
  return {std::move(child_counts), std::move(centers)};
}

NearestBits FindNearest(std::span<const DescriptorBits> candidates, const DescriptorBits& query) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(query.data());
  NearestBits nearest;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const int distance = cv::hal::normHamming(reinterpret_cast<const unsigned char*>(candidates[i].data()),
                                              bytes, sizeof(DescriptorBits));
    if (distance < nearest.distance) {
      nearest = {static_cast<int>(i), distance};
    }
  }
  return nearest;
}

DescriptorBits MajorityOf(std::span<const DescriptorBits> descriptors) {
  // 256 counters as bit planes: planes[p] holds bit p of each, and a descriptor is added to all of them at
  // once by carrying from plane to plane.
  std::vector<DescriptorBits> planes;
  for (const DescriptorBits& descriptor : descriptors) {
    DescriptorBits carry = descriptor;
    for (std::size_t p = 0; (carry[0] | carry[1] | carry[2] | carry[3]) != 0; ++p) {
      if (p == planes.size()) {
        planes.emplace_back();
      }
      for (std::size_t w = 0; w < carry.size(); ++w) {
        const std::uint64_t next = planes[p][w] & carry[w];
        planes[p][w] ^= carry[w];
        carry[w] = next;
      }
    }
  }
  DescriptorBits majority{};
  for (std::size_t bit = 0; bit < 256; ++bit) {
    std::size_t count = 0;
    for (std::size_t p = 0; p < planes.size(); ++p) {
      count |= static_cast<std::size_t>((planes[p][bit / 64] >> (bit % 64)) & 1U) << p;
    }
    if (2 * count > descriptors.size()) {
      majority[bit / 64] |= std::uint64_t{1} << (bit % 64);
    }
  }
  return majority;
}

}  // namespace sqslam
