#include "slam/objects/merging.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "seen_landmark.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/util/enum_names.h"
#include "test_camera.h"

namespace sqslam {
namespace {

using testing::kHours;
using testing::ObservationOf;
using testing::SeenAt;

// Two things that stand side by side in every image must never be taken for one.
TEST(Merging, KeepsLandmarksSeenTogetherApartInLongRuns) {
  const Landmark old_one = SeenAt(100.0, kHours);
  const Landmark young_one = SeenAt(300.0, 5000);
  EXPECT_GE(FramesSeenApart(old_one, young_one), 10);
  EXPECT_EQ(FramesSeenApart(old_one, SeenAt(300.0, kHours)), static_cast<int>(old_one.views.size()));
}

TEST(Merging, CountsCommonFramesWhenOneBeginsLate) {
  const Landmark cup = SeenAt(100.0, 100);  // frames 1 to 100
  const auto seen_from = [](int first) {
    Landmark other;
    for (int frame = first; frame < first + 50; frame += 2) {
      other.Add(ObservationOf("cup", {300.0, 100.0, 40.0, 50.0}, frame));
    }
    return other;
  };
  for (const auto& [first, apart] : {std::pair(1, 25), {60, 21}, {99, 1}, {100, 1}, {101, 0}, {500, 0}}) {
    EXPECT_EQ(FramesSeenApart(cup, seen_from(first)), apart) << first;
    EXPECT_EQ(FramesSeenApart(seen_from(first), cup), apart) << first;
  }
  EXPECT_EQ(FramesSeenApart(cup, Landmark()), 0);
}

TEST(Merging, CountsPartBoxedWithItsWholeAsOne) {
  Landmark chair;
  Landmark back;
  for (int frame = 0; frame < 8; ++frame) {
    chair.Add(ObservationOf("chair", {100, 100, 100, 300}, frame));
    back.Add(ObservationOf("chair", {105, 100, 90, 100}, frame));
  }
  EXPECT_EQ(FramesSeenApart(chair, back), 8);
  EXPECT_EQ(FramesSeenApart(chair, back, true), 0);
}

TEST(Merging, KeepsLargerBoxOfAFrame) {
  Landmark back;
  Landmark chair;
  for (int frame = 0; frame < 100; ++frame) {
    back.Add(ObservationOf("chair", {105, 100, 90, 100}, frame));
    if (frame < 50) {
      chair.Add(ObservationOf("chair", {100, 100, 100, 300}, frame + (frame < 20 ? 0 : 100)));
    }
  }
  back.Absorb(std::move(chair));
  EXPECT_EQ(back.views.size(), 130U) << "one box a frame";
  EXPECT_EQ(back.views.front().box.height, 300.0) << "the whole";
  EXPECT_EQ(back.views.at(50).box.height, 100.0);
}

TEST(Merging, MergesOverlappingDuplicatesUnlessSeenTogether) {
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
    return AreDuplicates(a, b, ObjectOptions(), Camera());
  };
  EXPECT_TRUE(same_at(0.15, 50));
  EXPECT_FALSE(same_at(0.19, 50)) << "side by side, as far as anyone can tell";
  EXPECT_FALSE(same_at(0.15, 10));
  EXPECT_TRUE(same_at(0.1, 10));
}

// A box on the floor at `x`, seen in `frames` frames from `first` on by a camera that moves sideways.
Landmark SeenOnFloor(const char* label, const Eigen::Vector3d& half_size, int first, int frames,
                     double x = 0.0) {
  Landmark landmark;
  landmark.superquadric.shape = {half_size, 0.1, 0.1};
  landmark.superquadric.T_map_object.translation = {x, 0.0, half_size.z()};
  landmark.estimated = landmark.refined = true;
  for (int frame = first; frame < first + frames; ++frame) {
    ObjectObservation observation;
    observation.frame_index = frame;
    observation.T_map_camera.rotation = Eigen::AngleAxisd(-M_PI / 2.0, Eigen::Vector3d::UnitX());
    observation.T_map_camera.translation = {0.01 * frame, -4.0, 0.5};
    const auto box = ProjectToBox(landmark.superquadric, observation.T_map_camera, testing::TestCamera());
    observation.detection = {label, 0.5, *box};
    observation.edge_free = {true, true, true, true};
    landmark.Add(observation);
  }
  return landmark;
}

TEST(Merging, NeedsAgreeingBoxesForTwoLabels) {
  const Landmark chair = SeenOnFloor("chair", {0.25, 0.25, 0.4}, 0, 40);
  const auto same = [&](const Landmark& other) {
    return AreDuplicates(chair, other, ObjectOptions(), testing::TestCamera());
  };
  EXPECT_FALSE(same(SeenOnFloor("dining_table", {0.8, 0.5, 0.36}, 60, 5)));
  EXPECT_TRUE(same(SeenOnFloor("bench", {0.26, 0.27, 0.42}, 60, 5))) << "the chair by another name";
  EXPECT_FALSE(same(SeenOnFloor("book", {0.1, 0.1, 0.1}, 60, 5))) << "within it, but another thing";
  Landmark bench = SeenOnFloor("bench", {0.26, 0.27, 0.42}, 60, 5);
  bench.views.front() = chair.views.back();
  EXPECT_TRUE(same(bench)) << "the boxes of the common frame coincide";
  bench.views.front().box.x += bench.views.front().box.width;
  EXPECT_FALSE(same(bench)) << "one frame shows them apart";
}

TEST(Merging, MergesChairCalledBenchFromOneSide) {
  const Camera camera = testing::TestCamera();
  const Landmark chair = SeenOnFloor("chair", {0.25, 0.25, 0.4}, 0, 60);
  Landmark bench = SeenOnFloor("bench", {0.26, 0.28, 0.4}, 40, 40);
  for (int i = 0; i < 8; ++i) {
    bench.views[static_cast<std::size_t>(i)].box.x += 100.0;  // a fifth of them
  }
  EXPECT_FALSE(AreDuplicates(chair, bench, ObjectOptions(), camera));
  EXPECT_TRUE(OccupySamePlace(chair, bench, camera));
  EXPECT_FALSE(OccupySamePlace(chair, SeenOnFloor("dining_table", {0.5, 0.4, 0.36}, 40, 40), camera))
      << "the chair is pushed under it";
}

TEST(Merging, MergesFlatDuplicatesOfTwoLabelsAtSmallOverlap) {
  const Camera camera = testing::TestCamera();
  constexpr double kHalfDepth = 0.02;
  const Landmark book = SeenOnFloor("book", {0.3, kHalfDepth, 0.25}, 0, 40);
  Landmark phone = SeenOnFloor("cell_phone", {0.28, kHalfDepth, 0.26}, 60, 40);
  phone.superquadric.T_map_object.translation.y() += 1.7 * kHalfDepth;  // 15 % are shared
  EXPECT_TRUE(OccupySamePlace(book, phone, camera));
  Landmark behind = phone;
  behind.superquadric.T_map_object.translation.y() += 0.5 * kHalfDepth;
  EXPECT_FALSE(OccupySamePlace(book, behind, camera));
  Landmark before = SeenOnFloor("cell_phone", {0.28, kHalfDepth, 0.26}, 20, 40);
  before.superquadric = phone.superquadric;
  EXPECT_FALSE(OccupySamePlace(book, before, camera)) << "half of the frames show both";
}

// Two tables in one place, one of which was given boxes of a chair beside it.
TEST(Merging, MergesDuplicatesAtTheSamePlace) {
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
  EXPECT_FALSE(AreDuplicates(a, b, ObjectOptions(), Camera()));
  EXPECT_TRUE(OccupySamePlace(a, b, Camera()));
  b.superquadric.T_map_object.translation.x() = 0.1;  // half of it
  EXPECT_FALSE(OccupySamePlace(a, b, Camera()));
  EXPECT_FALSE(OccupySamePlace(a, see(a, 11), Camera())) << "too often apart";
  b.views = see(a, 0).views;
  EXPECT_TRUE(OccupySamePlace(a, b, Camera())) << "never apart";
  b.superquadric.T_map_object.translation.x() = 0.15;  // a quarter
  EXPECT_FALSE(OccupySamePlace(a, b, Camera()));
  b = see(a, 0);
  b.labels = LabelVotes();
  b.labels.Add("bowl", 0.9);
  EXPECT_FALSE(OccupySamePlace(a, b, Camera()));
}

TEST(Merging, KeepsStackedBooksApartWhenEstimatesOverlap) {
  const Camera camera = testing::TestCamera();
  const Landmark lower = SeenOnFloor("book", {0.3, 0.2, 0.06}, 0, 40);
  const auto upper = [&](int first) {
    Landmark book = SeenOnFloor("book", {0.28, 0.2, 0.08}, first, 40);
    book.superquadric.T_map_object.translation.z() += 0.02;
    return book;
  };
  EXPECT_FALSE(OccupySamePlace(lower, upper(5), camera));
  EXPECT_FALSE(OccupySamePlace(lower, upper(18), camera)) << "the majority of the frames shows both";
  EXPECT_TRUE(OccupySamePlace(lower, upper(30), camera)) << "a quarter of the frames shows both";
}

// A chair seen from two sides, one estimate half its depth behind the other: their boxes agree.
TEST(Merging, MergesDuplicatesThatExplainEachOthersBoxes) {
  const Camera camera = testing::TestCamera();
  const Eigen::Vector3d half_size(0.25, 0.15, 0.4);
  const Landmark near = SeenOnFloor("chair", half_size, 0, 60);
  const auto behind = [&](double x) {
    Landmark far = SeenOnFloor("chair", half_size, 54, 40);
    far.superquadric.T_map_object.translation += Eigen::Vector3d(x, 0.15, 0.0);
    for (std::size_t i = 0; i < 6; ++i) {
      far.views[i].box.x += 150.0;  // of a chair beside it
    }
    return far;
  };
  EXPECT_TRUE(OccupySamePlace(near, behind(0.0), camera));
  EXPECT_FALSE(OccupySamePlace(near, behind(0.15), camera)) << "a third is shared, but the boxes differ";
}

// A screen and what boxes of the picture on it gave: thin, and mostly behind the screen's surface.
TEST(Merging, MergesPictureOnAScreenIntoTheScreen) {
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
  const auto same = [&] { return AreDuplicates(screen, picture, ObjectOptions(), camera); };
  ASSERT_LT(OverlapOfSmaller(screen.superquadric, picture.superquadric), MergingOptions().overlap);
  EXPECT_TRUE(same());
  // On another screen behind it.
  picture.superquadric.T_map_object.translation.y() = 0.2;
  EXPECT_FALSE(same());
  // Boxed beside the screen again and again: something that stands before it.
  picture.superquadric.T_map_object.translation.y() = 0.035;
  Landmark sticker = picture;
  see(sticker, 10, 5);
  EXPECT_FALSE(AreDuplicates(screen, sticker, ObjectOptions(), camera));
  // The same size, not a part of the screen.
  picture.superquadric.T_map_object.translation.y() = 0.035;
  EXPECT_TRUE(same());
  see(picture, 80, 8);
  EXPECT_FALSE(same());
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
    return AreDuplicates(a, b, options, Camera());
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
