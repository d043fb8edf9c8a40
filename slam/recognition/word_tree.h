#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "slam/features/frame_features.h"

namespace sqslam {

// A 256-bit descriptor as machine words, to count bits in four steps instead of 32.
using DescriptorBits = std::array<std::uint64_t, 4>;

inline DescriptorBits ToBits(const Descriptor& descriptor) {
  return std::bit_cast<DescriptorBits>(descriptor);
}

struct NearestBits {
  int index = -1;
  int distance = 257;  // differing bits, 0 to 256; 257 without candidates
};

// Returns the candidate with the smallest Hamming distance to the query; the first of equals.
NearestBits FindNearest(std::span<const DescriptorBits> candidates, const DescriptorBits& query);

// Returns the bitwise majority of the descriptors: their median under the Hamming distance.
DescriptorBits MajorityOf(std::span<const DescriptorBits> descriptors);

using WordId = std::uint32_t;
using NodeId = std::uint32_t;

struct VocabularyOptions {
  int branching = 10;      // children of a node
  int depth = 5;           // levels below the root: at most branching^depth words
  int iterations = 12;     // rounds per clustering, fewer if it converges
  std::uint64_t seed = 1;  // seeds the choice of first cluster centres

  void VisitFields(auto&& visit) {
    visit("branching", branching, 2, 255);
    visit("depth", depth, 1, 8);
    visit("iterations", iterations, 1, 1000);
    visit("seed", seed);
  }
};

// Receives the finished share of the work, in [0, 1].
using TrainingProgress = std::function<void(double)>;

// Vocabulary tree of binary descriptors: each node is a cluster, its children are the clusters within, and
// the leaves are the words (Nister & Stewenius, CVPR 2006). Nodes are numbered breadth first, so that
// siblings are adjacent; words are the leaves in the same order.
class WordTree {
 public:
  WordTree() : WordTree({0}, {DescriptorBits{}}) {}  // the root alone: one word

  // `child_counts[i]`, `centers[i]`: number of children and cluster centre of node i, breadth first (the
  // root's centre is unused). Throws std::invalid_argument with the reason if the counts make no tree.
  WordTree(std::vector<std::uint8_t> child_counts, std::vector<DescriptorBits> centers);

  // Hierarchical k-medians under the Hamming distance, each clustering seeded by k-means++ (Galvez-Lopez &
  // Tardos, T-RO 2012). Deterministic for the same descriptors, order and options, on any machine.
  static WordTree Train(std::vector<DescriptorBits> descriptors, const VocabularyOptions& options,
                        const TrainingProgress& progress = {});

  // Descends along the nearest centres to a leaf.
  WordId WordOf(const DescriptorBits& descriptor) const;

  std::size_t Nodes() const { return child_counts_.size(); }
  std::size_t Words() const { return words_; }
  int Depth() const { return depth_; }  // levels below the root
  const std::vector<std::uint8_t>& ChildCounts() const { return child_counts_; }
  const std::vector<DescriptorBits>& Centers() const { return centers_; }

 private:
  std::vector<std::uint8_t> child_counts_;
  std::vector<DescriptorBits> centers_;
  std::vector<NodeId> first_children_;
  std::vector<WordId> word_of_node_;  // leaves only
  std::size_t words_ = 0;
  int depth_ = 0;
};

}  // namespace sqslam
