// Films of others, where they are present.
#include <gtest/gtest.h>

#include <filesystem>

#include "slam/io/frame_source.h"
#include "slam/io/trajectory.h"
#include "slam/system.h"
#include "tests/support/textured_world.h"

namespace sqslam {
namespace {

// Its first frames show hardly more than a wall: a map that starts there at once ends up half a metre wrong.
TEST(RealFilm, WaitsForCertainMotionBeforeItStartsMap) {
  const std::filesystem::path folder = std::filesystem::path(SQSLAM_SOURCE_DIR) / "../shared/data/tsukuba";
  if (!std::filesystem::exists(folder / "rgb.txt")) {
    GTEST_SKIP() << "no sequence " << folder;
  }
  const Sequence sequence = OpenSequence({.path = folder});
  SystemOptions options;
  options.deterministic = true;
  options.vocabulary = "none";
  System system(sequence.camera, options, [](const MapSnapshotPtr&) {});
  FrameSource source(sequence, {.count = 80});
  while (const std::optional<Frame> frame = source.Next()) {
    system.Process(*frame);
  }
  const Trajectory path = system.Finish({}).map.trajectory;
  const auto truth_at = PosesByTime(ReadTrajectory(folder / "groundtruth.txt"));
  std::vector<Eigen::Vector3d> estimate;
  std::vector<Eigen::Vector3d> truth;
  for (const TimedPose& pose : path) {
    if (const std::optional<Rigid3d> known = truth_at(pose.timestamp)) {
      estimate.push_back(pose.T_map_camera.translation);
      truth.push_back(known->translation);
    }
  }
  ASSERT_GT(estimate.size(), 70U);
  EXPECT_LT(testing::AlignedError(estimate, truth), 0.015) << "metres";
}

}  // namespace
}  // namespace sqslam
