#include <gtest/gtest.h>

#include "slam/geometry/lie.h"
#include "slam/tracking/pose_tracker.h"
#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::MakeSyntheticMap;
using testing::SyntheticMap;

class FrameRefinement : public ::testing::Test {
 protected:
  // Keyframe 2 as if it were a frame, and where tracking against a worse map had put it.
  FrameRefinement() {
    const Keyframe& keyframe = world_.map.At(2);
    frame_.features = keyframe.features;
    frame_.points = keyframe.points;
    Vector6d delta;
    delta << 0.01, -0.02, 0.01, 0.03, -0.02, 0.04;
    tracked_ = Perturb(world_.T_camera_map[2], delta);
  }

  std::vector<FrameMatch> Matches() const { return MatchesOf(frame_, ScaleLevels(OrbOptions{})); }
  double Error(const Rigid3d& T_camera_map) const {
    return (T_camera_map.translation - world_.T_camera_map[2].translation).norm();
  }

  SyntheticMap world_ = MakeSyntheticMap({});
  TrackedFrame frame_;
  Rigid3d tracked_;
};

TEST_F(FrameRefinement, RecoversPoseFromMatches) {
  EXPECT_LT(Error(RefineFrame(world_.map, world_.camera, Matches(), 25, tracked_)), 1e-5);
}

TEST_F(FrameRefinement, FollowsFusedPoints) {
  std::vector<FrameMatch> matches = Matches();
  const PointId kept = matches[0].point;
  const PointId dropped =
      world_.map.AddPoint(world_.map.Point(kept).p_map + Eigen::Vector3d(0.1, 0.0, 0.0), 0);
  world_.map.Fuse(dropped, kept);
  for (FrameMatch& match : matches) {
    match.point = match.point == kept ? dropped : match.point;
  }
  matches.resize(1);
  for (const FrameMatch& match : Matches()) {
    if (match.point != kept && matches.size() < 25) {
      matches.push_back(match);
    }
  }
  EXPECT_LT(Error(RefineFrame(world_.map, world_.camera, matches, 25, tracked_)), 1e-5);
}

TEST_F(FrameRefinement, KeepsPoseWhenTooFewPointsAreLeft) {
  std::vector<FrameMatch> matches = Matches();
  for (std::size_t i = 20; i < matches.size(); ++i) {
    world_.map.RemovePoint(matches[i].point);
  }
  const Rigid3d refined = RefineFrame(world_.map, world_.camera, matches, 25, tracked_);
  EXPECT_EQ(refined.translation, tracked_.translation);
}

}  // namespace
}  // namespace sqslam
