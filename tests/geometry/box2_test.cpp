#include "slam/geometry/box2.h"

#include <gtest/gtest.h>

namespace sqslam {
namespace {

TEST(IsBeyondEdge, ChecksOnlyEdgesThatCount) {
  const Box2d box{100.0, 100.0, 50.0, 40.0};
  const std::array<bool, 4> all_but_bottom = {true, true, true, false};
  const auto beyond = [&](double x, double y) { return IsBeyondEdge(box, all_but_bottom, {x, y}, 2.0); };
  EXPECT_FALSE(beyond(120.0, 120.0));
  EXPECT_FALSE(beyond(120.0, 180.0));
  EXPECT_FALSE(beyond(99.0, 120.0));
  EXPECT_TRUE(beyond(97.0, 180.0));
  EXPECT_TRUE(beyond(120.0, 97.0));
  EXPECT_TRUE(beyond(153.0, 120.0));
}

}  // namespace
}  // namespace sqslam
