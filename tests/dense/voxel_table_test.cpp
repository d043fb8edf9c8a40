#include "slam/dense/voxel_table.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace sqslam {
namespace {

struct Sum {
  int total = 0;
  int first = 0;  // the earliest value

  void Add(const Sum& other) { total += other.total; }
};
using Table = VoxelTable<3, Sum>;

// Ten parts of values at random places of a small cube, so that many fall together.
std::vector<std::vector<std::pair<Table::Key, int>>> Values() {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> place(-8, 8);
  std::vector<std::vector<std::pair<Table::Key, int>>> parts(10);
  int value = 0;
  for (auto& part : parts) {
    for (int i = 0; i < 2000; ++i) {
      part.push_back({{place(random), place(random), place(random)}, ++value});
    }
  }
  return parts;
}

Table Filled(int threads) {
  const auto parts = Values();
  Table table;
  table.Add(parts.size(), threads, [&](std::size_t part, const auto& put) {
    for (const auto& [key, value] : parts[part]) {
      put(key, {value, value});
    }
  });
  return table;
}

TEST(VoxelTable, MergesValuesOfOneKeyInOrder) {
  std::map<Table::Key, Sum> expected;
  for (const auto& part : Values()) {
    for (const auto& [key, value] : part) {
      Sum& sum = expected[key];
      sum = {sum.total + value, sum.total == 0 ? value : sum.first};
    }
  }
  const Table table = Filled(3);
  std::size_t count = 0;
  for (std::size_t shard = 0; shard < Table::kShards; ++shard) {
    count += table.Values(shard).size();
  }
  EXPECT_EQ(count, expected.size());
  for (const auto& [key, sum] : expected) {
    const Sum* found = table.Find(key);
    ASSERT_NE(found, nullptr);
    EXPECT_EQ(found->total, sum.total);
    EXPECT_EQ(found->first, sum.first);
  }
  EXPECT_EQ(table.Find({100, 0, 0}), nullptr);
}

TEST(VoxelTable, OrderDoesNotDependOnThreads) {
  const Table one = Filled(1), four = Filled(4);
  for (std::size_t shard = 0; shard < Table::kShards; ++shard) {
    ASSERT_EQ(one.Values(shard).size(), four.Values(shard).size());
    for (std::size_t i = 0; i < one.Values(shard).size(); ++i) {
      EXPECT_EQ(one.Values(shard)[i].first, four.Values(shard)[i].first);
    }
  }
}

}  // namespace
}  // namespace sqslam
