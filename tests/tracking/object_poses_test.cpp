#include "slam/tracking/object_poses.h"

#include <gtest/gtest.h>

#include <memory>

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

TEST_F(ObjectPosesTest, FindsTheCameraFromExactBoxes) {
  const std::vector<Rigid3d> poses = PosesFromObjects(Boxes(PoseOnArc(2.5)), things_, map_.camera, 3);
  ASSERT_FALSE(poses.empty());
  EXPECT_LE(poses.size(), 3U);
  EXPECT_LT(CenterDistance(poses[0], PoseOnArc(2.5)), 0.02);
}

TEST_F(ObjectPosesTest, BoxesOfADetectorGiveARoughPose) {
  const std::vector<Rigid3d> poses = PosesFromObjects(Boxes(PoseOnArc(2.5), 3.0), things_, map_.camera, 3);
  ASSERT_FALSE(poses.empty());
  EXPECT_LT(CenterDistance(poses[0], PoseOnArc(2.5)), 0.3);
}

TEST_F(ObjectPosesTest, NeedsThreeBoxesOfKnownThings) {
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

// The last keyframe is unknown and there are no words: nothing but the boxes tells where the frame is.
TEST_F(ObjectPosesTest, BringALostFrameBackIfThePointsAgree) {
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
