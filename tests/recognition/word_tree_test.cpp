#include "slam/recognition/word_tree.h"

#include <gtest/gtest.h>

#include <set>
#include <stdexcept>

#include "slam/features/matching.h"
#include "tests/recognition/random_descriptors.h"

namespace sqslam::testing {
namespace {

TEST(DescriptorBits, FindsNearestByHammingDistance) {
  std::mt19937 random(1);
  std::vector<Descriptor> descriptors(20);
  std::generate(descriptors.begin(), descriptors.end(), [&] { return RandomDescriptor(random); });
  std::vector<DescriptorBits> bits(descriptors.size());
  std::transform(descriptors.begin(), descriptors.end(), bits.begin(), ToBits);
  for (int trial = 0; trial < 50; ++trial) {
    const Descriptor query = RandomDescriptor(random);
    NearestBits expected;
    for (std::size_t i = 0; i < descriptors.size(); ++i) {
      const int distance = HammingDistance(descriptors[i], query);
      if (distance < expected.distance) {
        expected = {static_cast<int>(i), distance};
      }
    }
    const NearestBits nearest = FindNearest(bits, ToBits(query));
    EXPECT_EQ(nearest.index, expected.index);
    EXPECT_EQ(nearest.distance, expected.distance);
  }
}

TEST(DescriptorBits, CountsMajorityBitByBit) {
  for (const int count : {1, 2, 3, 8, 101}) {
    std::mt19937 random(static_cast<unsigned>(count));
    std::vector<DescriptorBits> bits;
    for (int i = 0; i < count; ++i) {
      bits.push_back(ToBits(RandomDescriptor(random)));
    }
    const DescriptorBits majority = MajorityOf(bits);
    for (std::size_t bit = 0; bit < 256; ++bit) {
      const auto is_set = [bit](const DescriptorBits& d) { return ((d[bit / 64] >> (bit % 64)) & 1U) != 0; };
      EXPECT_EQ(is_set(majority), 2 * std::count_if(bits.begin(), bits.end(), is_set) > count) << bit;
    }
  }
}

// Two branches: one leaf, and one node with two leaves.
//        0
//      1   2
//         3 4
WordTree HandMadeTree() {
  const DescriptorBits zeros{};
  const DescriptorBits ones = {~0ULL, ~0ULL, ~0ULL, ~0ULL};
  const DescriptorBits low = {~0ULL, ~0ULL, 0xFFULL, 0};
  const DescriptorBits high = {0xFFULL, 0, ~0ULL, ~0ULL};
  return {{2, 0, 2, 0, 0}, {zeros, zeros, ones, low, high}};
}

TEST(WordTree, DescendsToNearestLeaf) {
  const WordTree tree = HandMadeTree();
  EXPECT_EQ(tree.Words(), 3u);
  EXPECT_EQ(tree.Depth(), 2);
  EXPECT_EQ(tree.WordOf({3, 0, 0, 0}), 0u);
  EXPECT_EQ(tree.WordOf({~0ULL, ~0ULL, 0xFULL, 7}), 1u);
  EXPECT_EQ(tree.WordOf({0, 0xFULL, ~0ULL, ~0ULL}), 2u);
}

TEST(WordTree, RefusesInvalidChildCounts) {
  const auto make = [](std::vector<std::uint8_t> counts) {
    std::vector<DescriptorBits> centers(counts.size());
    return WordTree(std::move(counts), std::move(centers));
  };
  EXPECT_THROW(make({}), std::invalid_argument);
  EXPECT_THROW(make({3, 0, 0}), std::invalid_argument) << "a child beyond the end";
  EXPECT_THROW(make({1, 0, 0}), std::invalid_argument) << "a node without a parent";
  EXPECT_THROW(make({0, 1}), std::invalid_argument) << "a node that would be its own child";
  EXPECT_THROW(WordTree({1, 0}, {DescriptorBits{}}), std::invalid_argument) << "a centre is missing";
  EXPECT_NO_THROW(make({2, 0, 0}));
}

TEST(WordTree, TrainingFindsClusters) {
  constexpr int kClusters = 6;
  constexpr int kMembers = 30;
  std::mt19937 random(5);
  std::vector<DescriptorBits> descriptors;
  for (int c = 0; c < kClusters; ++c) {
    const Descriptor center = RandomDescriptor(random);
    for (int i = 0; i < kMembers; ++i) {
      descriptors.push_back(ToBits(Disturbed(center, 10, random)));
    }
  }
  const WordTree tree = WordTree::Train(descriptors, {.branching = kClusters, .depth = 1});
  ASSERT_EQ(tree.Words(), static_cast<std::size_t>(kClusters));
  std::set<WordId> words;
  for (int c = 0; c < kClusters; ++c) {
    const WordId word = tree.WordOf(descriptors[static_cast<std::size_t>(c * kMembers)]);
    words.insert(word);
    for (int i = 0; i < kMembers; ++i) {
      EXPECT_EQ(tree.WordOf(descriptors[static_cast<std::size_t>(c * kMembers + i)]), word);
    }
  }
  EXPECT_EQ(words.size(), static_cast<std::size_t>(kClusters));
}

TEST(WordTree, DoesNotSplitEqualDescriptors) {
  EXPECT_EQ(WordTree::Train(std::vector<DescriptorBits>(50, {1, 2, 3, 4}), {}).Words(), 1u);
  const WordTree two = WordTree::Train({{1, 2, 3, 4}, {5, 6, 7, 8}, {1, 2, 3, 4}}, {});
  EXPECT_EQ(two.Words(), 2u);
  EXPECT_EQ(two.Depth(), 1);
}

TEST(WordTree, TrainingRespectsBranchingAndDepth) {
  std::vector<DescriptorBits> descriptors;
  for (const auto& image : ClusteredImages(10, 100, 40, 3)) {
    std::transform(image.begin(), image.end(), std::back_inserter(descriptors), ToBits);
  }
  std::vector<double> shares;
  const WordTree tree = WordTree::Train(descriptors, {.branching = 4, .depth = 3},
                                        [&](double share) { shares.push_back(share); });
  EXPECT_EQ(tree.Depth(), 3);
  EXPECT_LE(tree.Words(), 64u);
  EXPECT_GT(tree.Words(), 32u);
  EXPECT_LE(*std::max_element(tree.ChildCounts().begin(), tree.ChildCounts().end()), 4);
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_NEAR(shares.back(), 1.0, 1e-9);
}

}  // namespace
}  // namespace sqslam::testing
