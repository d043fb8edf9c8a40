#include "slam/tracking/object_poses.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <string>

#include "slam/objects/landmark_geometry.h"
#include "slam/tracking/relocalizer.h"
#include "tests/support/synthetic_map.h"
#include "tests/support/tracked_frame.h"

namespace sqslam {
namespace {

using testing::CenterDistance;
using testing::MakeSyntheticMap;
using testing::NewFrame;
using testing::PoseOnArc;
using testing::SyntheticMap;

// Five things among the points of the synthetic map, two of them cups.
ObjectMapView Things() {
  ObjectMapView view;
  const auto add = [&](const char* label, const Eigen::Vector3d& centre, const Eigen::Vector3d& half_size) {
    ObjectLandmarkView landmark;
    landmark.id = static_cast<int>(view.landmarks.size());
    landmark.label = label;
    landmark.estimated = landmark.shown = true;
    landmark.superquadric = {{half_size, 0.3, 1.0}, {Eigen::Quaterniond::Identity(), centre}};
    view.landmarks.push_back(landmark);
  };
  add("cup", {-0.7, 0.3, 0.2}, {0.1, 0.12, 0.1});
  add("cup", {0.6, 0.1, -0.5}, {0.1, 0.12, 0.1});
  add("book", {0.1, 0.5, 0.4}, {0.25, 0.05, 0.2});
  add("tv", {0.2, -0.6, 0.5}, {0.5, 0.3, 0.05});
  add("chair", {-0.5, -0.4, -0.4}, {0.2, 0.3, 0.2});
  return view;
}

class ObjectPosesTest : public ::testing::Test {
 protected:
  // The boxes that a detector would find from a pose, each edge off by `noise` px in or out by turns.
  std::vector<BoxCandidate> Boxes(const Rigid3d& T_camera_map, double noise = 0.0) const {
    std::vector<BoxCandidate> boxes;
    for (const ObjectLandmarkView& thing : things_.landmarks) {
      const auto box = ProjectToBox(thing.superquadric, T_camera_map.Inverse(), map_.camera);
      if (box && map_.camera.InImage(box->Center())) {
        BoxCandidate candidate;
        const double d = boxes.size() % 2 == 0 ? noise : -noise;
        candidate.detection = {thing.label, 0.9, {box->x + d, box->y - d, box->width, box->height + d}};
        boxes.push_back(candidate);
      }
    }
    return boxes;
  }

  SyntheticMap map_ = MakeSyntheticMap({});
  ObjectMapView things_ = Things();
};

TEST_F(ObjectPosesTest, FindsCameraFromExactBoxes) {
  const std::vector<Rigid3d> poses = PosesFromObjects(Boxes(PoseOnArc(2.5)), things_, map_.camera, 3);
  ASSERT_FALSE(poses.empty());
  EXPECT_LE(poses.size(), 3U);
  EXPECT_LT(CenterDistance(poses[0], PoseOnArc(2.5)), 0.02);
}

TEST_F(ObjectPosesTest, FindsRoughPoseFromDetectorBoxes) {
  const std::vector<Rigid3d> poses = PosesFromObjects(Boxes(PoseOnArc(2.5), 3.0), things_, map_.camera, 3);
  ASSERT_FALSE(poses.empty());
  EXPECT_LT(CenterDistance(poses[0], PoseOnArc(2.5)), 0.3);
}

TEST_F(ObjectPosesTest, NeedsThreeBoxesOfKnownObjects) {
  std::vector<BoxCandidate> boxes = Boxes(PoseOnArc(2.5));
  ASSERT_GE(boxes.size(), 4U);
  for (std::size_t i = 2; i < boxes.size(); ++i) {
    boxes[i].detection.label = "zebra";
  }
  EXPECT_TRUE(PosesFromObjects(boxes, things_, map_.camera, 3).empty());
  EXPECT_TRUE(PosesFromObjects({}, things_, map_.camera, 3).empty());
  for (ObjectLandmarkView& thing : things_.landmarks) {
    thing.shown = false;
  }
  EXPECT_TRUE(PosesFromObjects(Boxes(PoseOnArc(2.5)), things_, map_.camera, 3).empty());
}

// Six things of each of 36 labels, of which the frame shows one: over a million triples, one in 216 is right.
TEST_F(ObjectPosesTest, FindsCameraAmongBillionsOfTriples) {
  constexpr int kLabels = 36;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-0.8, 0.8);
  std::uniform_real_distribution<double> size(0.05, 0.2);
  const auto add_one_of_each = [&] {
    for (int label = 0; label < kLabels; ++label) {
      ObjectLandmarkView& thing = things_.landmarks.emplace_back();
      thing.id = static_cast<int>(things_.landmarks.size()) - 1;
      thing.label = std::to_string(label);
      thing.estimated = thing.shown = true;
      thing.superquadric = {{{size(random), size(random), size(random)}, 0.3, 1.0},
                            {Eigen::Quaterniond::Identity(), {place(random), place(random), place(random)}}};
    }
  };
  things_.landmarks.clear();
  add_one_of_each();
  const std::vector<BoxCandidate> boxes = Boxes(PoseOnArc(2.5));
  ASSERT_GE(boxes.size(), 32U);
  for (int more = 0; more < 5; ++more) {
    add_one_of_each();
  }
  const std::vector<Rigid3d> poses = PosesFromObjects(boxes, things_, map_.camera, 3);
  ASSERT_FALSE(poses.empty());
  EXPECT_LT(CenterDistance(poses[0], PoseOnArc(2.5)), 0.05);
}

// As many triples would take over ten gigabytes.
TEST_F(ObjectPosesTest, UsesLittleMemoryForDozensOfEqualLabels) {
  constexpr int kChairs = 60;
  constexpr int kBoxes = 25;
  things_.landmarks.clear();
  for (int i = 0; i < kChairs; ++i) {
    ObjectLandmarkView& chair = things_.landmarks.emplace_back();
    chair.id = i;
    chair.label = "chair";
    chair.estimated = chair.shown = true;
    chair.superquadric = {{{1e-3, 1e-3, 1e-3}, 0.3, 1.0},
                          {Eigen::Quaterniond::Identity(), {0.2 * (i % 8), 0.2 * (i / 8), 0.05 * (i % 7)}}};
  }
  std::vector<BoxCandidate> boxes(kBoxes);
  for (int i = 0; i < kBoxes; ++i) {
    boxes[static_cast<std::size_t>(i)].detection = {
        "chair", 0.9, {90.0 * (i % 5) + 3.0 * (i / 5), 60.0 * (i / 5) + 2.0 * (i % 5), 150.0, 150.0}};
  }
  EXPECT_TRUE(PosesFromObjects(boxes, things_, map_.camera, 3).empty()) << "none is as large as its box";
}

// The last keyframe is unknown and there are no words: nothing but the boxes tells where the frame is.
TEST_F(ObjectPosesTest, RelocatesLostFrameWhenPointsAgree) {
  const PoseTracker tracker(map_.camera, {});
  Relocalizer relocalizer(nullptr);
  TrackingView view = MakeTrackingView(map_.map);
  view.objects = std::make_shared<const ObjectMapView>(things_);
  const auto shared = std::make_shared<const TrackingView>(std::move(view));
  const TrackedFrame frame = NewFrame(map_.See(PoseOnArc(2.5), {.pixel_noise = 0.1, .clutter = 50}).features);
  EXPECT_FALSE(relocalizer.ByWords(tracker, nullptr, shared, std::nullopt, frame));
  const auto found = relocalizer.ByObjects(tracker, map_.camera, Boxes(PoseOnArc(2.5), 2.0), frame);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->view, shared);
  EXPECT_GT(found->frame.inliers, 150);
  EXPECT_LT(CenterDistance(found->frame.T_camera_map, PoseOnArc(2.5)), 1e-3);

  // The same boxes in another room, whose points look different.
  const TrackedFrame other = NewFrame(MakeSyntheticMap({.seed = 99}).See(PoseOnArc(2.5)).features);
  EXPECT_FALSE(relocalizer.ByObjects(tracker, map_.camera, Boxes(PoseOnArc(2.5), 2.0), other));
}

}  // namespace
}  // namespace sqslam
