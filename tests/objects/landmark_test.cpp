#include "slam/objects/landmark.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "seen_landmark.h"

namespace sqslam {
namespace {

using testing::kHours;
using testing::ObservationOf;
using testing::SeenAt;

TEST(Landmark, KeepsEveryViewOfAShortRun) {
  const Landmark landmark = SeenAt(100.0, 1500);
  EXPECT_EQ(landmark.views.size(), 1500U);
  EXPECT_EQ(landmark.observations, 1500);
}

TEST(Landmark, KeepsAnEvenShareOfViewsOfALongRun) {
  for (const int stride : {1, 2, 64}) {
    const Landmark landmark = SeenAt(100.0, kHours, stride);
    EXPECT_EQ(landmark.observations, kHours);
    EXPECT_LE(landmark.views.size(), 2000U) << stride;
    EXPECT_GE(landmark.views.size(), 500U) << stride;
    const auto first_half =
        std::count_if(landmark.views.begin(), landmark.views.end(),
                      [&](const BoxView& v) { return v.frame_index < std::int64_t{stride} * kHours / 2; });
    EXPECT_NEAR(static_cast<double>(first_half) / static_cast<double>(landmark.views.size()), 0.5, 0.05);
  }
}

TEST(Landmark, KeepsTheSameFramesAsAnyOther) {
  std::set<std::int64_t> kept;  // of a run twice as long
  for (const BoxView& view : SeenAt(100.0, 2 * kHours).views) {
    kept.insert(view.frame_index);
  }
  Landmark landmark = SeenAt(100.0, kHours);
  landmark.Absorb(SeenAt(300.0, kHours));
  EXPECT_GE(landmark.views.size(), 1400U);
  for (const BoxView& view : landmark.views) {
    EXPECT_TRUE(kept.contains(view.frame_index)) << view.frame_index;
  }
}

// Merging two maps renumbers the frames of one of them.
TEST(Landmark, KeepsHalfOfItsViewsAfterRenumbering) {
  Landmark landmark = SeenAt(100.0, kHours);
  Landmark later = landmark;
  for (BoxView& view : landmark.views) {
    view.frame_index += 1;
  }
  for (BoxView& view : later.views) {
    view.frame_index += kHours + 5;
  }
  const auto before = static_cast<double>(landmark.views.size() + later.views.size());
  landmark.Absorb(std::move(later));
  const auto early =
      std::ranges::count_if(landmark.views, [](const BoxView& view) { return view.frame_index < kHours; });
  EXPECT_NEAR(static_cast<double>(landmark.views.size()), 0.5 * before, 1.0);
  EXPECT_NEAR(static_cast<double>(early), 0.25 * before, 2.0);
}

TEST(PointVotes, KeepPositionsOfTheCameras) {
  const std::vector<Eigen::Vector3d> cameras = {{1, 0, 0}, {3, 0, 0}, {1, 2, 0}, {3, 2, 0}};
  Landmark::PointVotes votes;
  Landmark::PointVotes others;
  const Eigen::Vector3d above(2, 1, 5);
  EXPECT_EQ(votes.CameraSpread(above), 0.0);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    (i < 3 ? votes : others).SeeInside(cameras[i]);
  }
  votes.Merge(others);
  EXPECT_EQ(votes.inside, 4);
  EXPECT_TRUE(votes.MeanCamera().isApprox(Eigen::Vector3d(2, 1, 0)));
  EXPECT_NEAR(votes.CameraSpread(above), std::sqrt(2.0), 1e-12);
  // Towards a point in the plane of the cameras half of the motion is along the line of sight.
  EXPECT_NEAR(votes.CameraSpread({9, 1, 0}), 1.0, 1e-12);
  const Sim3d S{1.7,
                Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized())),
                {5.0, -4.0, 2.0}};
  votes.Transform(S);
  EXPECT_TRUE(votes.MeanCamera().isApprox(S * Eigen::Vector3d(2, 1, 0)));
  EXPECT_NEAR(votes.CameraSpread(S * above), 1.7 * std::sqrt(2.0), 1e-9);
}

// A landmark with a few points, seen from frames of which the even ones move by one similarity and the odd
// ones by another, in a map that was bent.
TEST(Landmark, MovesWithTheFramesThatSawIt) {
  const auto motion = [](double side) {
    return Sim3d{std::exp(0.1 * side),
                 Eigen::Quaterniond(Eigen::AngleAxisd(0.5 + 0.05 * side, Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(0.04, Eigen::Vector3d::UnitX())),
                 {3.0, 0.1 * side, -0.2}};
  };
  const Eigen::Vector3d center(1.0, 2.0, 0.5);
  Landmark landmark;
  for (int frame = 0; frame < 10; ++frame) {
    ObjectObservation o = ObservationOf("cup", {100, 100, 40, 50}, frame);
    o.T_map_camera.translation = center + Eigen::Vector3d(2.0 * std::cos(frame), 2.0 * std::sin(frame), 1.0);
    o.point_ids = {7};
    o.centroid = center;
    o.yaw = YawEstimate{0.2, 1.0};
    o.lines = {{{0.0, 0.0}, {9.0, 0.0}}};
    landmark.Add(o);
  }
  landmark.estimated = landmark.refined = true;
  landmark.superquadric = {{{0.1, 0.2, 0.3}, 0.5, 0.5},
                           {Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ())), center}};
  landmark.visible = landmark.superquadric;
  const Landmark before = landmark;
  landmark.MoveWith([&](std::int64_t frame) { return motion(frame % 2 == 0 ? 1.0 : -1.0); });
  for (std::size_t i = 0; i < before.views.size(); ++i) {
    const Sim3d S = motion(before.views[i].frame_index % 2 == 0 ? 1.0 : -1.0);
    EXPECT_TRUE(
        landmark.views[i].T_map_camera.Matrix().isApprox((S * before.views[i].T_map_camera).Matrix()));
    EXPECT_TRUE(landmark.lines[i].second.T_map_camera.Matrix().isApprox(
        (S * before.lines[i].second.T_map_camera).Matrix()));
  }
  const Eigen::Vector3d moved = 0.5 * (motion(1.0) * center + motion(-1.0) * center);
  EXPECT_LT((landmark.centroids.mean - moved).norm(), 1e-9);
  EXPECT_LT((landmark.superquadric.T_map_object.translation - moved).norm(), 1e-9);
  EXPECT_TRUE(landmark.superquadric.shape.half_size.isApprox(before.superquadric.shape.half_size));
  // Upright as before, and turned as the map was about its vertical.
  EXPECT_TRUE((landmark.superquadric.T_map_object.rotation * Eigen::Vector3d::UnitZ())
                  .isApprox(Eigen::Vector3d::UnitZ()));
  EXPECT_NEAR(landmark.yaw.Mean(), 0.7, 1e-3);
  EXPECT_TRUE(landmark.refined);
  const auto distance = [&](const Landmark& l) {
    return (l.votes.at(7).MeanCamera() - l.centroids.mean).norm();
  };
  EXPECT_NEAR(distance(landmark), distance(before), 1e-6);
}

TEST(Landmark, CountsAllObservationsWhenAbsorbing) {
  Landmark landmark = SeenAt(100.0, 1500);
  landmark.Absorb(SeenAt(100.0, kHours));
  EXPECT_EQ(landmark.observations, kHours + 1500);
  EXPECT_LE(landmark.views.size(), 2000U);
}

Landmark EstimatedAt(double x, int frames, double size) {
  Landmark landmark = SeenAt(x, frames);
  landmark.estimated = landmark.refined = true;
  landmark.estimated_at = frames;
  landmark.superquadric.shape.half_size *= size;
  return landmark;
}

TEST(Landmark, KeepsItsEstimateWhenMuchBetterKnown) {
  for (const bool old_first : {true, false}) {
    Landmark landmark = EstimatedAt(100.0, old_first ? 100 : 10, old_first ? 2.0 : 1.0);
    landmark.id = 7;
    landmark.Absorb(EstimatedAt(100.0, old_first ? 10 : 100, old_first ? 1.0 : 2.0));
    EXPECT_EQ(landmark.id, 7);
    EXPECT_TRUE(landmark.estimated);
    EXPECT_TRUE(landmark.refined);
    EXPECT_EQ(landmark.superquadric.shape.half_size.x(), 2.0);
    EXPECT_EQ(landmark.observations, 110);
  }
  Landmark equal = EstimatedAt(100.0, 100, 1.0);
  equal.Absorb(EstimatedAt(100.0, 80, 1.0));
  EXPECT_FALSE(equal.estimated);
}

TEST(Landmark, StaysUprightUnlessTheMapTurnsOver) {
  Landmark landmark = EstimatedAt(100.0, 10, 1.0);
  landmark.superquadric.T_map_object.translation = {1.0, 2.0, 3.0};
  const auto tilt = [](double radians) {
    Sim3d S;
    S.rotation = Eigen::AngleAxisd(radians, Eigen::Vector3d::UnitX());
    return S;
  };
  landmark.Transform(tilt(0.05));
  EXPECT_TRUE(landmark.refined);
  const Rigid3d& T = landmark.superquadric.T_map_object;
  EXPECT_NEAR((T.rotation * Eigen::Vector3d::UnitZ()).z(), 1.0, 1e-12);
  EXPECT_TRUE(T.translation.isApprox(tilt(0.05) * Eigen::Vector3d(1.0, 2.0, 3.0), 1e-12));
  landmark.Transform(tilt(0.5));
  EXPECT_FALSE(landmark.refined);
  EXPECT_EQ(landmark.estimated_at, 0);
}

TEST(LabelVotes, DecidesByScoresInsteadOfCounts) {
  LabelVotes votes;
  votes.Add("cup", 0.9);
  votes.Add("bowl", 0.3);
  votes.Add("bowl", 0.3);
  EXPECT_EQ(votes.Best(), "cup");
  EXPECT_DOUBLE_EQ(votes.BestScore(), 0.9);
  LabelVotes other;
  other.Add("bowl", 0.5);
  votes.Merge(other);
  EXPECT_EQ(votes.Best(), "bowl");
  EXPECT_NEAR(votes.BestScore(), 1.1 / 3.0, 1e-12);
  EXPECT_EQ(LabelVotes().Best(), "");
}

}  // namespace
}  // namespace sqslam
