#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "slam/system.h"
#include "tests/support/textured_world.h"

namespace sqslam {
namespace {

using testing::AlignedError;
using testing::HandHeldPath;
using testing::TexturedWorld;
using testing::ThroughLens;

// An equidistant lens that sees 115 degrees from left to right and 143 from corner to corner.
Camera EquidistantLens() {
  Camera lens{320, 240, 160.0, 160.0, 160.0, 120.0};
  lens.lens = LensModel::kFisheye;
  return lens;
}

// From images to the finished map and its trajectory.
TEST(System, MapsThroughFisheyeLens) {
  constexpr double kMaxError = 0.01;  // m, of a path through a world 1 to 4 m away
  const TexturedWorld world({1000, 760, 160.0, 160.0, 499.5, 379.5});
  const ThroughLens through_lens(EquidistantLens(), world.GetCamera());
  const std::vector<Rigid3d> path = HandHeldPath(60);
  SystemOptions options;
  options.deterministic = true;
  options.tracking.features.num_features = 600;
  System system(EquidistantLens(), options, [](const MapSnapshotPtr&) {});
  for (std::size_t i = 0; i < path.size(); ++i) {
    system.Process(through_lens(world.Render(static_cast<std::int64_t>(i), path[i])));
  }
  const RunResult result = system.Finish();
  ASSERT_NE(result.map.snapshot, nullptr) << result.no_map_reason;
  EXPECT_EQ(result.tracked, static_cast<int>(path.size()));
  std::vector<Eigen::Vector3d> estimate;
  std::vector<Eigen::Vector3d> truth;
  for (const TimedPose& pose : result.map.trajectory) {
    estimate.push_back(pose.T_map_camera.translation);
    truth.push_back(path[static_cast<std::size_t>(std::lround(pose.timestamp * 30.0))].translation);
  }
  EXPECT_LT(AlignedError(estimate, truth), kMaxError);
  // Points near the border, which a pinhole camera's model would put elsewhere, are mapped too.
  const Rigid3d T_camera_map = result.map.snapshot->keyframes.front().T_map_camera.Inverse();
  const auto beside = std::ranges::count_if(result.map.snapshot->points, [&](const SnapshotPoint& point) {
    const Eigen::Vector3d p_camera = T_camera_map * point.p_map.cast<double>();
    return p_camera.head<2>().norm() > 1.2 * p_camera.z();  // 50 degrees off the axis
  });
  EXPECT_GE(beside, 12);
}

}  // namespace
}  // namespace sqslam
