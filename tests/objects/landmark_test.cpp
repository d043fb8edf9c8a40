#include "slam/objects/landmark.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "slam/objects/landmark_geometry.h"
#include "slam/objects/merging.h"
#include "slam/util/enum_names.h"
#include "test_camera.h"

namespace sqslam {
namespace {

constexpr int kHours = 200000;  // frames

Landmark SeenAt(double x, int frames, int stride = 1) {
  Landmark landmark;
  for (int i = 0; i < frames; ++i) {
    ObjectObservation observation;
    observation.frame_index = 1 + i * stride;
    observation.detection.label = "cup";
    observation.detection.score = 0.5;
    observation.detection.box = {x, 100.0, 40.0, 50.0};
    landmark.Add(observation);
  }
  return landmark;
}

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

// Two things that stand side by side in every image must never be taken for one.
TEST(Landmark, ThoseSeenTogetherAreKnownToBeTwoHoweverLongTheRun) {
  const Landmark old_one = SeenAt(100.0, kHours);
  const Landmark young_one = SeenAt(300.0, 5000);
  EXPECT_GE(FramesSeenApart(old_one, young_one), 10);
  EXPECT_EQ(FramesSeenApart(old_one, SeenAt(300.0, kHours)), static_cast<int>(old_one.views.size()));
}

ObjectObservation ObservationOf(const std::string& label, const Box2d& box, std::int64_t frame_index) {
  ObjectObservation observation;
  observation.frame_index = frame_index;
  observation.detection = {label, 0.5, box};
  return observation;
}

TEST(Landmark, APartSeenWithItsWholeIsNotApart) {
  Landmark chair;
  Landmark back;
  for (int frame = 0; frame < 8; ++frame) {
    chair.Add(ObservationOf("chair", {100, 100, 100, 300}, frame));
    back.Add(ObservationOf("chair", {105, 100, 90, 100}, frame));
  }
  for (int frame = 8; frame < 16; ++frame) {
    chair.Add(ObservationOf("chair", {100, 100, 100, 300}, frame));
    back.Add(ObservationOf("chair", {105, 100, 90, 100}, 100 + frame));
  }
  EXPECT_EQ(FramesSeenApart(chair, back), 8);
  EXPECT_EQ(FramesSeenApart(chair, back, true), 0);
  // And they are one where their volumes share nearly all of the smaller.
  chair.estimated = back.estimated = true;
  chair.superquadric.shape = {{0.2, 0.2, 0.4}, 0.2, 0.2};
  back.superquadric.shape = {{0.15, 0.05, 0.15}, 0.2, 0.2};
  back.superquadric.T_map_object.translation.z() = 0.2;
  EXPECT_TRUE(AreSameObject(chair, back, ObjectOptions(), Camera()));
  back.superquadric.T_map_object.translation.z() = 0.4;  // half outside
  EXPECT_FALSE(AreSameObject(chair, back, ObjectOptions(), Camera()));
  // One nearly always boxed with the other is another thing, however much the two have in common.
  back.superquadric.T_map_object.translation.z() = 0.2;
  for (int frame = 0; frame < 20; ++frame) {
    chair.Add(ObservationOf("chair", {100, 100, 100, 300}, 200 + frame));
    back.Add(ObservationOf("chair", {105, 100, 90, 100}, 200 + frame));
  }
  EXPECT_FALSE(AreSameObject(chair, back, ObjectOptions(), Camera()));
}

// A detector that boxes a chair and its back at once, on the same points, while the chair is near; of what
// stands behind a chair in as many frames the points are others.
TEST(Landmark, AThingBoxedTwiceForAWhileIsOne) {
  for (const bool same_points : {true, false}) {
    Landmark back;
    Landmark chair;
    for (int frame = 0; frame < 100; ++frame) {
      ObjectObservation part = ObservationOf("chair", {105, 100, 90, 100}, frame);
      ObjectObservation whole = ObservationOf("chair", {100, 100, 100, 300}, frame);
      for (std::int64_t point = 0; point < 20; ++point) {
        part.point_ids.push_back(point);
        whole.point_ids.push_back(same_points ? point + 5 : point + 100);
      }
      back.Add(part);
      if (frame < 20) {
        chair.Add(whole);
      }
    }
    chair.estimated = back.estimated = true;
    chair.superquadric.shape = back.superquadric.shape = {{0.2, 0.2, 0.4}, 0.2, 0.2};
    chair.superquadric.T_map_object.translation.x() = 0.45;  // their estimates don't meet
    EXPECT_EQ(AreSameObject(chair, back, ObjectOptions(), Camera()), same_points);
    if (same_points) {
      back.Absorb(std::move(chair));
      EXPECT_EQ(back.views.size(), 100U) << "one box a frame";
      EXPECT_EQ(back.views.front().box.height, 300.0) << "the whole";
      EXPECT_EQ(back.views.back().box.height, 100.0);
    }
  }
}

TEST(PointVotes, TellWhereTheCamerasWere) {
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
TEST(Landmark, GoesWithTheFramesThatSawIt) {
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

TEST(Landmark, TwoOfAKindAcrossEachOtherAreOne) {
  Landmark a = SeenAt(100.0, 10);
  Landmark b;
  for (int frame = 50; frame < 60; ++frame) {
    b.Add(ObservationOf("cup", {100, 100, 40, 50}, frame));
  }
  a.superquadric.shape = b.superquadric.shape = {{0.3, 0.02, 0.2}, 0.1, 0.1};
  b.superquadric.T_map_object = {Eigen::Quaterniond(Eigen::AngleAxisd(1.3, Eigen::Vector3d::UnitZ())),
                                 {0.03, 0.0, 0.0}};
  a.estimated = b.estimated = true;
  const auto same = [&] { return AreSameObject(a, b, ObjectOptions(), Camera()); };
  EXPECT_TRUE(same());
  b.superquadric.T_map_object.translation.x() = 0.06;
  EXPECT_FALSE(same());
  b.superquadric.T_map_object.translation.x() = 0.03;
  b.labels = LabelVotes();
  b.labels.Add("bowl", 0.9);
  EXPECT_FALSE(same());
}

TEST(Landmark, TwoOfAKindThatReachIntoEachOtherAreOneUnlessSeenTogether) {
  const Landmark a = [] {
    Landmark seen = SeenAt(100.0, 20);
    seen.superquadric.shape = {{0.1, 0.1, 0.1}, 0.1, 0.1};
    seen.estimated = true;
    return seen;
  }();
  const auto same_at = [&](double distance, std::int64_t first_frame) {
    Landmark b = a;
    b.views.clear();
    for (int i = 0; i < 20; ++i) {
      b.Add(ObservationOf("cup", {180, 100, 40, 50}, i == 0 ? first_frame : 50 + i));
    }
    b.superquadric.T_map_object.translation.x() = distance;
    return AreSameObject(a, b, ObjectOptions(), Camera());
  };
  EXPECT_TRUE(same_at(0.15, 50));
  EXPECT_FALSE(same_at(0.19, 50)) << "side by side, as far as anyone can tell";
  EXPECT_FALSE(same_at(0.15, 10));
  EXPECT_TRUE(same_at(0.1, 10));
}

TEST(Landmark, AYoungTableOverAChairIsNotTheChair) {
  const Camera camera = testing::TestCamera();
  const auto known = [&](const char* label, const Eigen::Vector3d& half_size, int first, int frames) {
    Landmark landmark;
    landmark.superquadric.shape = {half_size, 0.1, 0.1};
    landmark.superquadric.T_map_object.translation = {0.0, 0.0, half_size.z()};
    landmark.estimated = true;
    for (int frame = first; frame < first + frames; ++frame) {
      ObjectObservation observation;
      observation.frame_index = frame;
      observation.T_map_camera.rotation = Eigen::AngleAxisd(-M_PI / 2.0, Eigen::Vector3d::UnitX());
      observation.T_map_camera.translation = {0.02 * (frame - first), -4.0, 0.5};
      const auto box = ProjectToBox(landmark.superquadric, observation.T_map_camera, camera);
      observation.detection = {label, 0.5, *box};
      observation.edge_free = {true, true, true, true};
      landmark.Add(observation);
    }
    return landmark;
  };
  const Landmark chair = known("chair", {0.25, 0.25, 0.4}, 0, 40);
  const auto same = [&](const Landmark& other) {
    return AreSameObject(chair, other, ObjectOptions(), camera);
  };
  EXPECT_FALSE(same(known("dining_table", {0.8, 0.5, 0.36}, 60, 5)));
  EXPECT_TRUE(same(known("bench", {0.26, 0.27, 0.42}, 60, 5))) << "the chair by another name";
  EXPECT_TRUE(same(known("book", {0.1, 0.1, 0.1}, 60, 5))) << "a part of it";
}

// Two tables in one place, one of which was given boxes of a chair beside it.
TEST(Landmark, TwoOfAKindCannotShareTheirPlace) {
  Landmark a = SeenAt(100.0, 40);
  a.superquadric.shape = {{0.1, 0.1, 0.1}, 0.1, 0.1};
  a.estimated = a.refined = true;
  const auto see = [&](Landmark b, int apart) {
    b.views.clear();
    for (int i = 0; i < 40; ++i) {
      b.Add(ObservationOf("cup", {100.0, 100, 40, 50}, 30 + i));
    }
    for (int i = 0; i < apart; ++i) {
      b.views[static_cast<std::size_t>(i)].box.x = 300.0;
    }
    return b;
  };
  Landmark b = see(a, 8);
  EXPECT_FALSE(AreSameObject(a, b, ObjectOptions(), Camera()));
  EXPECT_TRUE(ShareTheirPlace(a, b));
  b.superquadric.T_map_object.translation.x() = 0.1;  // half of it
  EXPECT_FALSE(ShareTheirPlace(a, b));
  EXPECT_FALSE(ShareTheirPlace(a, see(a, 11))) << "too often apart";
  b = see(a, 0);
  b.labels = LabelVotes();
  b.labels.Add("bowl", 0.9);
  EXPECT_FALSE(ShareTheirPlace(a, b));
}

// A screen and what boxes of the picture on it gave: thin, and mostly behind the screen's surface.
TEST(Landmark, APictureOnAScreenIsTheScreen) {
  const Camera camera = testing::TestCamera();
  Landmark screen;
  screen.superquadric.shape = {{0.4, 0.02, 0.25}, 0.1, 0.1};
  Landmark picture;
  picture.superquadric.shape = {{0.2, 0.02, 0.15}, 0.1, 0.1};
  picture.superquadric.T_map_object.translation = {0.1, 0.035, 0.0};
  screen.estimated = picture.estimated = true;
  const auto see = [&](Landmark& landmark, int first, int count) {
    for (int frame = first; frame < first + count; ++frame) {
      ObjectObservation observation;
      observation.frame_index = frame;
      observation.T_map_camera.rotation = Eigen::AngleAxisd(-M_PI / 2.0, Eigen::Vector3d::UnitX());
      observation.T_map_camera.translation = {0.02 * (frame - first), -2.0, 0.0};
      const auto box = ProjectToBox(landmark.superquadric, observation.T_map_camera, camera);
      observation.detection = {"tv", 0.5, *box};
      landmark.Add(observation);
    }
  };
  see(screen, 0, 20);
  see(picture, 50, 8);
  const auto same = [&] { return AreSameObject(screen, picture, ObjectOptions(), camera); };
  ASSERT_LT(OverlapOfSmaller(screen.superquadric, picture.superquadric), MergingOptions().overlap);
  EXPECT_TRUE(same());
  // On another screen behind it.
  picture.superquadric.T_map_object.translation.y() = 0.2;
  EXPECT_FALSE(same());
  // Boxed beside the screen again and again: something that stands before it.
  picture.superquadric.T_map_object.translation.y() = 0.035;
  Landmark sticker = picture;
  see(sticker, 10, 5);
  EXPECT_FALSE(AreSameObject(screen, sticker, ObjectOptions(), camera));
  // The same size, not a part of the screen.
  picture.superquadric.T_map_object.translation.y() = 0.035;
  EXPECT_TRUE(same());
  see(picture, 80, 8);
  EXPECT_FALSE(same());
}

TEST(Landmark, AbsorbingCountsAllObservations) {
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

TEST(Landmark, TheEstimateOfAMuchBetterKnownOneStays) {
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

TEST(LabelVotes, ScoresDecideNotCounts) {
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

Landmark WithCentroids(const Eigen::Vector3d& centre, int first_frame) {
  Landmark landmark;
  for (int i = 0; i < 8; ++i) {
    ObjectObservation observation;
    observation.frame_index = first_frame + i;
    observation.detection = {"cup", 0.5, {100.0, 100.0, 40.0, 50.0}};
    observation.centroid =
        centre + 0.01 * Eigen::Vector3d(std::sin(3.0 * i), std::cos(5.0 * i), std::sin(7.0 * i));
    landmark.Add(observation);
  }
  landmark.estimated = true;
  landmark.superquadric.shape.half_size.setConstant(0.05);
  landmark.superquadric.T_map_object.translation = centre;
  return landmark;
}

TEST(Merging, FollowsTheAssociationMethod) {
  using enum AssociationMethod;
  const Landmark a = WithCentroids({0, 0, 0}, 0);
  const Landmark same = WithCentroids({0.002, 0, 0}, 100);
  // One inside the other, but with centroids that differ: only the volumes tell.
  Landmark inside = WithCentroids({0.04, 0.04, 0.04}, 100);
  inside.superquadric = a.superquadric;
  const auto merges = [&](AssociationMethod method, const Landmark& b) {
    ObjectOptions options;
    options.association.method = method;
    return AreSameObject(a, b, options, Camera());
  };
  for (const auto method : {kIou, kIouPoints, kNonparametric}) {
    EXPECT_FALSE(merges(method, same)) << NameOf(method);
    EXPECT_FALSE(merges(method, inside)) << NameOf(method);
  }
  for (const auto method : {kIouTTest, kEnsemble}) {
    EXPECT_TRUE(merges(method, same)) << NameOf(method);
    EXPECT_FALSE(merges(method, inside)) << NameOf(method);
  }
  EXPECT_TRUE(merges(kFull, same));
  EXPECT_TRUE(merges(kFull, inside));
  EXPECT_FALSE(merges(kFull, WithCentroids({0.3, 0, 0}, 100)));
}

}  // namespace
}  // namespace sqslam
