#include "slam/util/thinned.h"

#include <gtest/gtest.h>

namespace sqslam {
namespace {

TEST(Thinned, TakesEvenStepsFromFirstItem) {
  EXPECT_EQ(Thinned(std::vector<int>{0, 1, 2, 3, 4, 5, 6}, 3), (std::vector<int>{0, 3, 6}));
  EXPECT_EQ(Thinned(std::vector<int>{0, 1, 2, 3, 4, 5, 6}, 6), (std::vector<int>{0, 2, 4, 6}));
  EXPECT_EQ(Thinned(std::vector<int>{4, 5, 6}, 1), (std::vector<int>{4}));
  EXPECT_EQ(Thinned(std::vector<int>{4, 5, 6}, 3), (std::vector<int>{4, 5, 6}));
  EXPECT_EQ(Thinned(std::vector<int>{}, 3), std::vector<int>{});
}

TEST(StepThrough, TakesNoMoreThanAllowed) {
  for (const std::size_t count : {0u, 1u, 120u, 121u, 239u, 240u, 241u}) {
    const std::size_t step = StepThrough(count, 120);
    EXPECT_LE((count + step - 1) / step, 120u) << count;
  }
  EXPECT_EQ(StepThrough(120, 120), 1u);
}

}  // namespace
}  // namespace sqslam
