#include "slam/map/point_table.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace sqslam {
namespace {

std::vector<std::string> Values(const PointTable<std::string>& table) {
  std::vector<std::string> values;
  for (const std::string& value : table) {
    values.push_back(value);
  }
  return values;
}

TEST(PointTable, IteratesInOrderOfIds) {
  PointTable<std::string> table;
  table.Add(0, "a");
  table.Add(1, "b");
  table.Add(2, "c");
  table.Remove(1);
  table.Add(7, "h");  // takes the slot of 1
  table.Add(5, "f");
  EXPECT_EQ(Values(table), (std::vector<std::string>{"a", "c", "f", "h"}));
  EXPECT_EQ(table.Size(), 4);
  EXPECT_FALSE(table.IsAlive(1));
  EXPECT_FALSE(table.IsAlive(100));
  EXPECT_EQ(table.At(7), "h");
}

TEST(PointTable, FollowsChainsOfReplacements) {
  PointTable<std::string> table;
  for (PointId id = 0; id < 4; ++id) {
    table.Add(id, std::to_string(id));
  }
  table.Remove(0, 1);
  table.Remove(1, 3);
  EXPECT_EQ(table.Resolve(0), 3);
  table.Remove(3);
  EXPECT_EQ(table.Resolve(0), kNoPoint);
  EXPECT_EQ(table.Resolve(2), 2);
  EXPECT_EQ(table.Resolve(99), kNoPoint);
  EXPECT_EQ(table.Resolve(kNoPoint), kNoPoint);
}

TEST(PointTable, ResolvesCircleToNoPoint) {
  PointTable<std::string> table;
  table.Add(0, "a");
  table.Add(1, "b");
  table.Remove(0, 1);
  table.Remove(1, 0);
  EXPECT_EQ(table.Resolve(0), kNoPoint);
}

TEST(PointTable, RecognisesSlotsUsedTwice) {
  PointTable<int> table;
  table.Add(0, 5);
  table.Add(1, 6);
  table.Remove(0, 1);
  EXPECT_TRUE(table.IsSound());
  PointTable<int>::VisitState(
      table, [](std::vector<std::int64_t>& entries, auto&, auto&) { entries[0] = entries[1]; });
  EXPECT_FALSE(table.IsSound());
}

TEST(PointTable, AbsorbsValuesAndReplacements) {
  PointTable<std::string> a;
  PointTable<std::string> b;
  a.Add(0, "a0");
  a.Add(4, "a4");
  b.Add(1, "b1");
  b.Add(2, "b2");
  b.Add(9, "b9");
  b.Remove(2, 9);
  a.Absorb(std::move(b));
  EXPECT_EQ(Values(a), (std::vector<std::string>{"a0", "b1", "a4", "b9"}));
  EXPECT_EQ(a.Resolve(2), 9);
}

TEST(PointTable, ReusesSlotsOfRemovedValues) {
  PointTable<std::vector<int>> table;
  for (PointId id = 0; id < 1000; ++id) {
    table.Add(id, std::vector<int>(10, static_cast<int>(id)));
    if (id >= 10) {
      table.Remove(id - 10);
    }
  }
  const auto copy = table.Map<int>([](const std::vector<int>& v) { return v.empty() ? -1 : v[0]; });
  EXPECT_EQ(table.Size(), 10);
  EXPECT_EQ(copy.At(995), 995);
  EXPECT_EQ(copy.Size(), 10);
}

}  // namespace
}  // namespace sqslam
