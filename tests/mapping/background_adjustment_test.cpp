#include "slam/mapping/background_adjustment.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <stdexcept>
#include <thread>

#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::MakeSyntheticMap;
using testing::SyntheticMap;

void Disturb(Map& map) {
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0.0, 0.01);
  for (const MapPoint& point : map.Points()) {
    map.Point(point.id).p_map += Eigen::Vector3d(noise(random), noise(random), noise(random));
  }
}

double MeanReprojectionError(const SyntheticMap& world) {
  double sum = 0.0;
  int count = 0;
  for (const MapPoint& point : world.map.Points()) {
    for (const Observation& o : point.observations) {
      const Keyframe& keyframe = world.map.At(o.keyframe);
      sum += (world.camera.Project(keyframe.T_camera_map * point.p_map) -
              keyframe.features->keypoints[static_cast<std::size_t>(o.keypoint)].pixel)
                 .norm();
      ++count;
    }
  }
  return sum / count;
}

BackgroundAdjustment::Job WaitFor(BackgroundAdjustment& adjustment) {
  for (;;) {
    if (auto job = adjustment.TakeFinished()) {
      return std::move(*job);
    }
    std::this_thread::yield();
  }
}

TEST(BackgroundAdjustment, GivesTheSameSolutionInStep) {
  SyntheticMap world = MakeSyntheticMap({});
  Disturb(world.map);
  const BundleProblem problem = ExtractBundleProblem(world.map, world.camera);
  std::vector<BundleProblem> solutions;
  for (const bool in_step : {true, false}) {
    BackgroundAdjustment adjustment(in_step);
    EXPECT_FALSE(adjustment.TakeFinished());
    adjustment.Start({3, {}, problem}, {10, 10});
    solutions.push_back(WaitFor(adjustment).problem);
    EXPECT_FALSE(adjustment.TakeFinished());  // once
  }
  for (std::size_t i = 0; i < solutions[0].points.size(); ++i) {
    EXPECT_EQ(solutions[0].points[i].p_map, solutions[1].points[i].p_map);
  }
}

TEST(BackgroundAdjustment, FinishesAtFixedCallInStep) {
  SyntheticMap world = MakeSyntheticMap({});
  Disturb(world.map);
  BackgroundAdjustment adjustment(true);
  adjustment.Start({0, {}, ExtractBundleProblem(world.map, world.camera)}, {10, 10});
  for (int call = 1; call < BackgroundAdjustment::kCallsInStep; ++call) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_FALSE(adjustment.TakeFinished());
  }
  EXPECT_TRUE(adjustment.TakeFinished());
}

TEST(BackgroundAdjustment, GivesSolutionThatIsWaitedForOnce) {
  SyntheticMap world = MakeSyntheticMap({});
  Disturb(world.map);
  BackgroundAdjustment adjustment(true);
  EXPECT_FALSE(adjustment.Wait());
  adjustment.Start({0, {}, ExtractBundleProblem(world.map, world.camera)}, {10, 10});
  EXPECT_TRUE(adjustment.Wait());
  EXPECT_FALSE(adjustment.Wait());
}

TEST(BackgroundAdjustment, DiscardsResultWhenStopped) {
  SyntheticMap world = MakeSyntheticMap({});
  Disturb(world.map);
  BackgroundAdjustment adjustment(false);
  adjustment.Start({0, {}, ExtractBundleProblem(world.map, world.camera)}, {10, 10});
  adjustment.Stop();
  EXPECT_FALSE(adjustment.TakeFinished());
}

TEST(BackgroundAdjustment, ThrowsErrorOnlyWhenResultIsTaken) {
  const auto fail = [](BundleProblem&, const BundleSolverOptions&, const std::function<bool()>&) -> bool {
    throw std::runtime_error("no memory");
  };
  BackgroundAdjustment adjustment(false, fail);
  adjustment.Start({}, {10, 10});
  EXPECT_THROW(WaitFor(adjustment), std::runtime_error);
  adjustment.Start({}, {10, 10});
  EXPECT_NO_THROW(adjustment.Stop());
  EXPECT_FALSE(adjustment.TakeFinished());
  adjustment.Start({}, {10, 10});  // stopped by the destructor
}

// While the problem was being solved, the map was moved, one keyframe came and one went.
TEST(ApplyAdjustment, AdaptsToMovedAndGrownMap) {
  SyntheticMap world = MakeSyntheticMap({.keyframes = 6, .points = 200});
  Disturb(world.map);
  BundleProblem problem = ExtractBundleProblem(world.map, world.camera);
  ASSERT_TRUE(SolveBundle(problem, {20, 20}, {}));

  const Sim3d S_new_old{
      1.7,
      Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d(1.0, 2.0, 0.5).normalized())),
      {0.3, -0.1, 2.0}};
  world.map.Transform(S_new_old);
  world.map.RemoveKeyframe(4);
  const Rigid3d T_5_map = world.map.At(5).T_camera_map;
  const KeyframeId added = world.map.AddKeyframe(6, 0.2, T_5_map, world.map.At(5).features);
  world.map.At(added).parent = 5;
  const Eigen::Vector3d p_5 = T_5_map * world.map.Point(11).p_map;
  const PointId point = world.map.AddPoint(world.map.Point(11).p_map, added);
  world.map.AddObservation(point, added, 12);
  world.map.RemoveObservation(12, 5);
  world.map.AddObservation(point, 5, 12);

  ApplyAdjustment(problem, S_new_old, world.map);
  // The new keyframe still stands where keyframe 5 stands, and its point before it as it was.
  EXPECT_TRUE(
      world.map.At(added).T_camera_map.Matrix().isApprox(world.map.At(5).T_camera_map.Matrix(), 1e-9));
  EXPECT_TRUE((world.map.At(added).T_camera_map * world.map.Point(point).p_map).isApprox(p_5, 1e-9));
  world.map.RemovePoint(point);
  EXPECT_LT(MeanReprojectionError(world), 0.01);
}

}  // namespace
}  // namespace sqslam
