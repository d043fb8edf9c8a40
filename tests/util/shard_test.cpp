#include "slam/util/shard.h"

#include <gtest/gtest.h>

#include "slam/util/error.h"

namespace sqslam {
namespace {

TEST(ShardTest, CoversAllItemsOnce) {
  for (const int total : {1, 7, 100}) {
    int next = 5;
    for (int i = 1; i <= 9; ++i) {
      const auto [first, end] = ItemsOf({i, 9}, 5, 5 + total);
      EXPECT_EQ(first, next);
      next = end;
    }
    EXPECT_EQ(next, 5 + total);
  }
  EXPECT_EQ(ItemsOf({1, 2}, 5, 40, 10), std::pair(5, 25));  // 35 items are four units
  EXPECT_EQ(ItemsOf({2, 2}, 5, 40, 10), std::pair(25, 40));
}

TEST(ShardTest, ParsesNumbersAndNamesPart) {
  EXPECT_EQ(PartName("a/turn.mp4", ParseShard("2/8")), "a/turn.part-2-of-8.mp4");
  EXPECT_EQ(PartName("a/turn.mp4", {}), "a/turn.mp4");
  for (const char* text : {"", "2", "0/8", "9/8", "1/0", "a/b", "1/2x", "-1/2"}) {
    EXPECT_THROW(ParseShard(text), UsageError) << text;
  }
}

}  // namespace
}  // namespace sqslam
