#include "slam/evaluation/object_matching.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

namespace sqslam {
namespace {

using Eigen::Vector3d;
using testing::ElementsAre;
using testing::IsEmpty;
constexpr double kPi = std::numbers::pi;

Rigid3d Pose(const Vector3d& center, double yaw = 0.0) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Vector3d::UnitZ())), center};
}

GroundTruthObject Truth(int id, const Vector3d& center, const Vector3d& half_size, double yaw = 0.0) {
  return {id, "", "box", {SolidKind::kCuboid, half_size, 0.1, 0.1, Pose(center, yaw)}, 100, true};
}

SnapshotObject Mapped(int id, const Vector3d& center, const Vector3d& half_size, double yaw = 0.0) {
  SnapshotObject object;
  object.id = id;
  object.label = "box";
  object.superquadric = {{half_size, 0.1, 0.1}, Pose(center, yaw)};
  return object;
}

TEST(MatchObjects, ScoresPerfectMap) {
  const std::vector truth = {Truth(1, {0, 0, 0}, {0.1, 0.2, 0.3}), Truth(2, {2, 0, 0}, {0.3, 0.2, 0.1}, 0.4)};
  const std::vector mapped = {Mapped(7, {2, 0, 0}, {0.3, 0.2, 0.1}, 0.4),
                              Mapped(8, {0, 0, 0}, {0.1, 0.2, 0.3})};
  const ObjectMatching matching = MatchObjects(mapped, truth, {});
  ASSERT_EQ(matching.matches.size(), 2u);
  EXPECT_EQ(matching.matches[0].mapped, 1);
  EXPECT_EQ(matching.matches[1].mapped, 0);
  for (const ObjectMatch& match : matching.matches) {
    EXPECT_GT(match.iou, 0.95);                      // rounded edges of e = 0.1
    EXPECT_NEAR(match.iou_ellipsoid, 0.726, 0.005);  // of the largest overlap
    EXPECT_NEAR(match.center_error, 0.0, 1e-12);
    EXPECT_NEAR(match.size_error, 0.0, 1e-12);
    EXPECT_NEAR(match.yaw_error, 0.0, 1e-7);
    EXPECT_TRUE(match.label_agrees);
  }
  EXPECT_THAT(matching.missed, IsEmpty());
  EXPECT_THAT(matching.extra, IsEmpty());
  EXPECT_THAT(matching.duplicates, IsEmpty());
}

TEST(MatchObjects, AppliesTheWholeSimilarityToTheMap) {
  const Sim3d S{0.25, Eigen::Quaterniond(Eigen::AngleAxisd(1.2, Vector3d(1, 2, 3).normalized())), {1, -2, 3}};
  GroundTruthObject truth = Truth(1, {0, 0, 0}, {0.1, 0.2, 0.3});
  const SnapshotObject mapped = Mapped(1, {4, 5, 6}, {0.4, 0.8, 1.2}, 0.3);
  truth.solid.T_map_object = Transform(S, Solid::FromSuperquadric(mapped.superquadric)).T_map_object;
  const ObjectMatching matching = MatchObjects({mapped}, {truth}, S);
  ASSERT_EQ(matching.matches.size(), 1u);
  EXPECT_GT(matching.matches[0].iou, 0.95);
  EXPECT_NEAR(matching.matches[0].size_error, 0.0, 1e-9);
  EXPECT_NEAR(matching.matches[0].tilt_error, 0.0, 1e-6);
}

TEST(MatchObjects, MeasuresErrorsPerAxisDirection) {
  const auto truth = Truth(1, {0, 0, 0}, {0.1, 0.2, 0.3});
  // The same box with x and y swapped and turned back by a quarter, shifted by 3 cm, 10 degrees off, 2 cm too
  // high.
  const auto mapped = Mapped(1, {0.03, 0, 0}, {0.2, 0.1, 0.31}, kPi / 2 + kPi / 18);
  const ObjectMatching matching = MatchObjects({mapped}, {truth}, {});
  ASSERT_EQ(matching.matches.size(), 1u);
  EXPECT_NEAR(matching.matches[0].center_error, 0.03, 1e-12);
  EXPECT_NEAR(matching.matches[0].size_error, 0.02 / 3, 1e-9);
  EXPECT_NEAR(matching.matches[0].yaw_error, kPi / 18, 1e-9);
}

TEST(MatchObjects, AssignsOptimally) {
  // Greedy by IoU would give the middle object to the left truth and leave the right one alone.
  const std::vector truth = {Truth(1, {0, 0, 0}, {1, 1, 1}), Truth(2, {1.2, 0, 0}, {1, 1, 1})};
  const std::vector mapped = {Mapped(1, {0.5, 0, 0}, {1, 1, 1}), Mapped(2, {-0.6, 0, 0}, {1, 1, 1})};
  const ObjectMatching matching = MatchObjects(mapped, truth, {});
  ASSERT_EQ(matching.matches.size(), 2u);
  EXPECT_EQ(matching.matches[0].mapped, 1);
  EXPECT_EQ(matching.matches[1].mapped, 0);
}

TEST(MatchObjects, DistinguishesDuplicateExtraAndMissed) {
  const std::vector truth = {Truth(1, {0, 0, 0}, {0.1, 0.1, 0.1}), Truth(2, {5, 0, 0}, {0.1, 0.1, 0.1})};
  const std::vector mapped = {Mapped(1, {0.03, 0, 0}, {0.1, 0.1, 0.1}), Mapped(2, {0, 0, 0}, {0.1, 0.1, 0.1}),
                              Mapped(3, {-3, 0, 0}, {0.1, 0.1, 0.1})};
  const ObjectMatching matching = MatchObjects(mapped, truth, {});
  ASSERT_EQ(matching.matches.size(), 1u);
  EXPECT_EQ(matching.matches[0].mapped, 1);
  ASSERT_EQ(matching.duplicates.size(), 1u);
  EXPECT_EQ(matching.duplicates[0].mapped, 0);
  EXPECT_EQ(matching.duplicates[0].truth, 0);
  EXPECT_THAT(matching.extra, ElementsAre(2));
  EXPECT_THAT(matching.missed, ElementsAre(1));
}

TEST(MatchObjects, MatchesThinObjectByPositionIfSizesAgree) {
  const std::vector magazine = {Truth(1, {0, 0, 0}, {0.1, 0.15, 0.002})};
  const auto above = MatchObjects({Mapped(1, {0, 0, 0.01}, {0.1, 0.14, 0.002})}, magazine, {});
  ASSERT_EQ(above.matches.size(), 1u);
  EXPECT_EQ(above.matches[0].iou, 0.0);
  EXPECT_THAT(MatchObjects({Mapped(1, {0, 0, 0.01}, {0.8, 0.8, 0.8})}, magazine, {}).extra, ElementsAre(0));
  EXPECT_THAT(MatchObjects({Mapped(1, {0.12, 0, 0.01}, {0.1, 0.1, 0.002})}, magazine, {}).extra,
              ElementsAre(0));
}

TEST(MatchObjects, MatchesVisiblePartWithSameLabel) {
  const std::vector truth = {Truth(1, {0, 0, 0}, {0.25, 0.25, 0.4})};
  std::vector mapped = {Mapped(1, {0, 0.2, 0.25}, {0.2, 0.04, 0.12})};
  ObjectMatching matching = MatchObjects(mapped, truth, {});
  ASSERT_EQ(matching.matches.size(), 1u);
  EXPECT_LT(matching.matches[0].iou, 0.1);
  mapped[0].label = "cup";  // another thing there
  EXPECT_THAT(MatchObjects(mapped, truth, {}).extra, ElementsAre(0));
  mapped = {Mapped(1, {0, 0.29, 0.25}, {0.2, 0.04, 0.12})};  // mostly outside
  EXPECT_THAT(MatchObjects(mapped, truth, {}).extra, ElementsAre(0));
  mapped = {Mapped(1, {0, 0.2, 0.25}, {0.04, 0.04, 0.04})};  // too small
  EXPECT_THAT(MatchObjects(mapped, truth, {}).extra, ElementsAre(0));
}

TEST(MatchObjects, PrefersSameLabel) {
  const std::vector truth = {Truth(1, {0, 0, 0}, {0.25, 0.25, 0.4})};
  std::vector mapped = {Mapped(1, {0.25, 0, 0}, {0.5, 0.5, 0.4}),
                        Mapped(2, {0, 0.2, 0.25}, {0.2, 0.04, 0.12})};
  EXPECT_EQ(MatchObjects(mapped, truth, {}).matches[0].mapped, 0);
  mapped[0].label = "dining_table";
  EXPECT_EQ(MatchObjects(mapped, truth, {}).matches[0].mapped, 1);
}

TEST(MatchObjects, ComparesLabelsWithoutRequiringThem) {
  auto truth = Truth(1, {0, 0, 0}, {0.1, 0.1, 0.1});
  truth.label = "cereal box";
  auto mapped = Mapped(1, {0, 0, 0}, {0.1, 0.1, 0.1});
  mapped.label = "microwave";
  EXPECT_FALSE(MatchObjects({mapped}, {truth}, {}).matches.at(0).label_agrees);
  mapped.label = "cereal_box";
  EXPECT_TRUE(MatchObjects({mapped}, {truth}, {}).matches.at(0).label_agrees);
}

TEST(MatchObjects, HandlesEmptyMapAndEmptyTruth) {
  EXPECT_THAT(MatchObjects({}, {Truth(1, {0, 0, 0}, {1, 1, 1})}, {}).missed, ElementsAre(0));
  EXPECT_THAT(MatchObjects({Mapped(1, {0, 0, 0}, {1, 1, 1})}, {}, {}).extra, ElementsAre(0));
}

}  // namespace
}  // namespace sqslam
