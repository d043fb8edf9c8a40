#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "slam/tracking/pose_tracker.h"
#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::ExactRing;
using testing::MakeRingMap;
using testing::SyntheticMap;

constexpr int kAll = 100;  // more keyframes than there are

class LocalMapTest : public ::testing::Test {
 protected:
  TrackingView View() const { return MakeTrackingView(ring_.map); }
  const std::vector<PointId>& Points(KeyframeId id) const { return ring_.map.At(id).points; }

  SyntheticMap ring_ = MakeRingMap(ExactRing());
};

TEST_F(LocalMapTest, ReferencesKeyframeThatSharesMostPoints) {
  EXPECT_EQ(FindLocalMap(View(), Points(9), 9, kAll).reference, 9);
  EXPECT_EQ(FindLocalMap(View(), Points(9), 7, kAll).reference, 9) << "wherever the search began";
}

TEST_F(LocalMapTest, HoldsPointsOfTwoCovisibilityStepsOnce) {
  const TrackingView view = View();
  const LocalMap local = FindLocalMap(view, Points(9), 9, kAll);
  std::set<PointId> expected;
  for (const KeyframeId near : view.keyframes.at(9).covisible) {
    for (const KeyframeId further : view.keyframes.at(near).covisible) {
      const auto& points = Points(further);
      expected.insert(points.begin(), points.end());
    }
  }
  expected.erase(kNoPoint);
  std::vector<PointId> points = local.points;
  std::sort(points.begin(), points.end());
  EXPECT_EQ(points, std::vector<PointId>(expected.begin(), expected.end()));
  EXPECT_LT(points.size(), static_cast<std::size_t>(ring_.map.NumPoints()) * 3 / 4)
      << "and not the far side of the ring";
}

TEST_F(LocalMapTest, KeepsKeyframesThatShareMost) {
  const LocalMap local = FindLocalMap(View(), Points(9), 9, 1);
  std::set<PointId> expected(Points(9).begin(), Points(9).end());
  EXPECT_EQ(std::set<PointId>(local.points.begin(), local.points.end()), expected);
  for (const int count : {2, 3, 5}) {
    const LocalMap more = FindLocalMap(View(), Points(9), 9, count);
    EXPECT_GT(more.points.size(), expected.size());
    expected = {more.points.begin(), more.points.end()};
  }
}

TEST_F(LocalMapTest, StartsAtLastReferenceWithoutMatches) {
  const std::vector<PointId> nothing(50, kNoPoint);
  EXPECT_EQ(FindLocalMap(View(), nothing, 12, kAll).reference, 12);
  EXPECT_FALSE(FindLocalMap(View(), nothing, 12, kAll).points.empty());
}

TEST_F(LocalMapTest, StartsAtNewestKeyframeWhenReferenceIsGone) {
  ring_.map.RemoveKeyframe(12);
  EXPECT_EQ(FindLocalMap(View(), {}, 12, kAll).reference, 23);
  EXPECT_EQ(FindLocalMap(View(), {}, kNoKeyframe, kAll).reference, 23);
}

TEST_F(LocalMapTest, ExcludesRemovedPoints) {
  const std::vector<PointId> before = Points(9);
  const PointId gone = before[3];
  ring_.map.RemovePoint(gone);
  const LocalMap local = FindLocalMap(View(), before, 9, kAll);
  EXPECT_EQ(local.reference, 9);
  EXPECT_EQ(std::count(local.points.begin(), local.points.end(), gone), 0);
}

}  // namespace
}  // namespace sqslam
