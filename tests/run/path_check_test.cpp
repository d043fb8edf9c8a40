#include "slam/run/path_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "slam/io/frame_source.h"
#include "slam/system.h"
#include "tests/app/written_sequence.h"
#include "tests/support/textured_world.h"

namespace sqslam {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A walk at 30 frames a second, 1 cm a frame, with some sway.
Trajectory Walk(int frames) {
  Trajectory walk;
  for (int i = 0; i < frames; ++i) {
    walk.push_back({i / 30.0, {{1, 0, 0, 0}, {0.01 * i, 0.004 * std::sin(0.7 * i), 0.0}}});
  }
  return walk;
}

TEST(FindJumps, AcceptsWalk) {
  EXPECT_TRUE(FindJumps(Walk(200)).empty());
  EXPECT_TRUE(FindJumps({}).empty());
  EXPECT_TRUE(FindJumps(Walk(3)).empty());
}

TEST(FindJumps, AcceptsGapInTime) {
  Trajectory walk = Walk(200);
  walk.erase(walk.begin() + 100, walk.begin() + 150);
  EXPECT_TRUE(FindJumps(walk).empty());
}

TEST(FindJumps, FindsPartThatIsElsewhere) {
  Trajectory walk = Walk(200);
  for (int i = 120; i < 200; ++i) {
    walk[i].T_map_camera.translation.y() += 0.8;
  }
  const std::vector<PathJump> jumps = FindJumps(walk);
  ASSERT_EQ(jumps.size(), 1U);
  EXPECT_EQ(jumps[0].after, 120U);
  EXPECT_GT(jumps[0].times, 50.0);
}

TEST(FindJumps, FindsSingleWrongPose) {
  Trajectory walk = Walk(200);
  walk[60].T_map_camera.translation.z() = 2.0;
  EXPECT_EQ(FindJumps(walk).size(), 2U) << "there and back";
}

// Matches of points 2 to 4 units away and at most `height` above or below the camera, seen before and after a
// step.
std::vector<TwoViewMatch> MatchesAcross(const Camera& camera, const Rigid3d& T_after_before,
                                        double height = 0.8) {
  std::vector<TwoViewMatch> matches;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d p(std::sin(1.7 * i), height * std::cos(2.9 * i), 3.0 + std::sin(5.3 * i));
    matches.push_back({camera.Project(p), camera.Project(T_after_before * p)});
  }
  return matches;
}

class JudgeStepTest : public ::testing::Test {
 protected:
  StepEvidence Judge(const std::vector<TwoViewMatch>& matches, const Rigid3d& T_after_before) const {
    return JudgeStep(camera_, matches, T_after_before, 1.5, 6.0);
  }
  const Camera camera_{640, 480, 500.0, 500.0, 320.0, 240.0};
  const Rigid3d step_{{1, 0, 0, 0}, {0.3, 0.02, -0.1}};
  const Rigid3d none_{};
};

TEST_F(JudgeStepTest, ConfirmsStepThatTheImagesShow) {
  EXPECT_EQ(Judge(MatchesAcross(camera_, step_), step_), StepEvidence::kConfirmed);
  EXPECT_EQ(Judge(MatchesAcross(camera_, none_), none_), StepEvidence::kConfirmed);
}

TEST_F(JudgeStepTest, ConfirmsTremorWhenTheCameraStandsStill) {
  EXPECT_EQ(Judge(MatchesAcross(camera_, none_), {{1, 0, 0, 0}, {0.01, -0.01, 0.01}}),
            StepEvidence::kConfirmed);
}

// Any horizontal motion of a pixel is that of some depth if the baseline is long.
TEST_F(JudgeStepTest, DoesNotConfirmWrongRotation) {
  const Rigid3d aside{{1, 0, 0, 0}, {0.3, 0.0, 0.0}};
  const Rigid3d turned{Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY())),
                       {-1.0, 0.0, 0.0}};
  const std::vector<TwoViewMatch> matches = MatchesAcross(camera_, aside, 0.15);
  EXPECT_EQ(Judge(matches, aside), StepEvidence::kConfirmed);
  EXPECT_EQ(Judge(matches, turned), StepEvidence::kNone);
  // The matches of a step too short for a map determine the rotation all the same.
  const Rigid3d slightly_aside{{1, 0, 0, 0}, {0.045, 0.0, 0.0}};
  EXPECT_EQ(Judge(MatchesAcross(camera_, slightly_aside, 0.15), turned), StepEvidence::kNone);
  EXPECT_EQ(Judge(MatchesAcross(camera_, none_, 0.15), turned), StepEvidence::kNone)
      << "nor does the camera move";
}

TEST_F(JudgeStepTest, ContradictsJumpBetweenImagesThatAreAlike) {
  EXPECT_EQ(Judge(MatchesAcross(camera_, none_), step_), StepEvidence::kContradicted);
  EXPECT_EQ(Judge(MatchesAcross(camera_, step_), none_), StepEvidence::kContradicted);
}

TEST_F(JudgeStepTest, LeavesFewMatchesUndecided) {
  std::vector<TwoViewMatch> matches = MatchesAcross(camera_, none_);
  matches.resize(100);
  EXPECT_EQ(Judge(matches, step_), StepEvidence::kNone);
}

TEST_F(JudgeStepTest, FindsCutWhenNothingMatches) {
  std::vector<TwoViewMatch> matches = MatchesAcross(camera_, step_);
  matches.resize(10);
  EXPECT_EQ(Judge(matches, step_), StepEvidence::kCut);
}

TEST(PosesThatContradict, TakesShorterSideOfEachContradiction) {
  const auto wrong = StepEvidence::kContradicted;
  EXPECT_THAT(PosesThatContradict({{4, 30.0, wrong}, {6, 30.0, wrong}}, 10), ElementsAre(4, 5));
  EXPECT_THAT(PosesThatContradict({{8, 30.0, wrong}}, 10), ElementsAre(8, 9));
  EXPECT_THAT(PosesThatContradict({{2, 30.0, wrong}}, 10), ElementsAre(0, 1));
  EXPECT_THAT(PosesThatContradict({{4, 30.0, StepEvidence::kCut}, {6, 30.0, wrong}}, 10),
              ElementsAre(6, 7, 8, 9));
}

TEST(PosesThatContradict, TakesNoneWhenNoJumpIsContradicted) {
  EXPECT_THAT(PosesThatContradict({{4, 30.0, StepEvidence::kNone}}, 10), IsEmpty());
}

// The map of a film of the textured world.
class CheckPathTest : public ::testing::Test {
 protected:
  FinishedMap MapOf(const Sequence& sequence) const {
    SystemOptions options;
    options.deterministic = true;
    options.vocabulary = "none";
    System system(sequence.camera, options, [](const MapSnapshotPtr&) {});
    FrameSource source(sequence);
    while (const std::optional<Frame> frame = source.Next()) {
      system.Process(*frame);
    }
    return system.Finish({}).map;
  }
  static constexpr std::size_t kFrames = 60;
};

TEST_F(CheckPathTest, LeavesOutPosesThatTheImagesContradict) {
  const testing::WrittenSequence written(testing::HandHeldPath(kFrames));
  const Sequence sequence = OpenSequence({.path = written.Path()});
  FinishedMap map = MapOf(sequence);
  ASSERT_EQ(map.trajectory.size(), kFrames);
  EXPECT_THAT(CheckPath(sequence, sequence.camera, map), IsEmpty());
  for (int i = 30; i < 34; ++i) {
    map.trajectory[i].T_map_camera.translation.x() += 0.8;
  }
  EXPECT_THAT(CheckPath(sequence, sequence.camera, map),
              ElementsAre(AllOf(HasSubstr("frame 29 (0.967 s) and frame 30 (1.000 s)"),
                                HasSubstr("frame 33 (1.100 s) and frame 34 (1.133 s)")),
                          AllOf(HasSubstr("4 of 60 poses"), HasSubstr("frame 30 (1.000 s) to frame 33"))));
  ASSERT_EQ(map.trajectory.size(), kFrames - 4);
  EXPECT_NEAR(map.trajectory[30].timestamp, 34 / 30.0, 1e-6);
}

TEST_F(CheckPathTest, AcceptsCutBetweenOverlappingViews) {
  std::vector<Rigid3d> path = testing::HandHeldPath(2 * kFrames);
  path.erase(path.begin() + kFrames / 2, path.begin() + 3 * kFrames / 2);
  const testing::WrittenSequence written(path);
  const Sequence sequence = OpenSequence({.path = written.Path()});
  FinishedMap map = MapOf(sequence);
  EXPECT_THAT(CheckPath(sequence, sequence.camera, map), IsEmpty()) << "both sides show the same";
}

}  // namespace
}  // namespace sqslam
