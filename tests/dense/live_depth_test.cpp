#include "slam/dense/live_depth.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "slam/dense/densify.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "tests/app/written_sequence.h"
#include "tests/dense/panel_world.h"

namespace sqslam::testing {
namespace {

constexpr DepthRange kRange{2.0, 6.0};  // its middle is 3

DenseInput ThreeFrames() {
  DenseInput input;
  input.camera = {320, 240, 300.0, 300.0, 160.0, 120.0, {}, 30.0};
  for (int i = 0; i < 3; ++i) {
    input.frames.push_back({i, {Eigen::Quaterniond::Identity(), {0.2 * i, 0.0, 0.0}}});
    input.sequence.frames.push_back({0.1 * i, ""});
  }
  input.keyframes = {input.frames[1]};
  input.ids = {7};
  return input;
}

LiveEstimate EstimateFrom(const DenseInput& input, double scale) {
  LiveEstimate estimate{"as-ever", {}};
  const Rigid3d T_keyframe_map = input.keyframes[0].T_map_camera.Inverse();
  for (const std::size_t view : {0U, 2U}) {
    Rigid3d pose = T_keyframe_map * input.frames[view].T_map_camera;
    pose.translation /= scale;
    estimate.T_keyframe_view[input.frames[view].index] = pose;
  }
  return estimate;
}

TEST(LiveDepth, KeepsDepthWhenMapOnlyMovedTurnedOrGrew) {
  DenseInput input = ThreeFrames();
  const LiveEstimate estimate = EstimateFrom(input, 2.5);
  const Rigid3d moved{Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY())), {3.0, 1.0, 2.0}};
  for (PosedFrame& frame : input.frames) {
    frame.T_map_camera = moved * frame.T_map_camera;
  }
  input.keyframes = {input.frames[1]};
  EXPECT_NEAR(ScaleIfValid(estimate, input, 0, kRange).value(), 2.5, 1e-9);
}

TEST(LiveDepth, InvalidatesDepthWhenViewMovedOrIsGone) {
  DenseInput input = ThreeFrames();
  const LiveEstimate estimate = EstimateFrom(input, 1.0);
  input.frames[2].T_map_camera.translation.y() += 0.004;  // 0.4 pixels in the middle of the depths
  EXPECT_TRUE(ScaleIfValid(estimate, input, 0, kRange));
  input.frames[2].T_map_camera.translation.y() += 0.004;
  EXPECT_FALSE(ScaleIfValid(estimate, input, 0, kRange));
  input.frames.pop_back();
  EXPECT_FALSE(ScaleIfValid(estimate, input, 0, kRange));
}

TEST(LiveDepth, ReadsBackSettingsAndPoses) {
  const LiveEstimate estimate = EstimateFrom(ThreeFrames(), 3.0);
  const auto read = LiveEstimate::FromText(estimate.Text());
  ASSERT_TRUE(read);
  EXPECT_EQ(read->settings, "as-ever");
  EXPECT_EQ(read->Text(), estimate.Text());
  EXPECT_EQ(read->T_keyframe_view.at(2).translation, estimate.T_keyframe_view.at(2).translation);
  const std::string whole = estimate.Text();
  EXPECT_FALSE(LiveEstimate::FromText(whole.substr(0, whole.size() - 8)));
  EXPECT_FALSE(LiveEstimate::FromText("0123456789abcdef"));
  EXPECT_FALSE(LiveEstimate::FromText(""));
}

TEST(LiveDepth, InvalidatesDepthOfFastCameraWhenShutterIsLearntLater) {
  DenseInput input = ThreeFrames();
  const LiveEstimate estimate = EstimateFrom(input, 1.0);
  input.readout = 0.002;  // 0.4 m in 0.2 s: 200 pixels a second, 0.2 pixels at the border
  EXPECT_TRUE(ScaleIfValid(estimate, input, 0, kRange));
  input.readout = 0.02;
  EXPECT_FALSE(ScaleIfValid(estimate, input, 0, kRange));
}

TEST(LiveDepth, WritesDepthMapsBesideRunningRecording) {
  constexpr int kFrames = 14;
  std::vector<Rigid3d> path;
  for (int i = 0; i < kFrames; ++i) {
    path.push_back({Eigen::Quaterniond::Identity(), {0.06 * (i - 7), 0.01 * (i % 3), 0.0}});
  }
  const TexturedWorld world;
  const WrittenSequence images(path);
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.Path() / "map.sqmap";
  RecordingWriter writer(file, {images.Path().string(), "test", ""});
  DenseOptions options;
  options.views.min_overlap = 0.3;
  options.stereo.planes = 32;
  SequenceRequest request;
  request.path = images.Path();
  LiveDepth live(file, OpenSequence(request), options);
  auto map = std::make_shared<MapSnapshot>();
  map->camera = world.GetCamera();
  for (int i = 0; i < kFrames; ++i) {
    live.Tracked(i, path[static_cast<std::size_t>(i)]);
    map->keyframes.push_back({100 + i, i, i / 30.0, path[static_cast<std::size_t>(i)]});
  }
  for (int v = 5; v < 240; v += 15) {
    for (int u = 5; u < 320; u += 15) {
      const double z = TrueDepth(world, map->camera, path[0], u, v);
      map->points.push_back(
          {(path[0] * Eigen::Vector3d(z * map->camera.Unproject({double(u), double(v)}))).cast<float>(),
           {},
           -1});
    }
  }
  live.Mapped(map);
  std::size_t seen = 0;
  for (int wait = 0; wait < 600 && seen < 2; ++wait) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    writer.Add(*map);  // goes on beside it
    seen = DepthRecording(file).Keyframes().size();
  }
  EXPECT_GE(seen, 2U);
  const int made = live.Finish();
  writer.Close();
  ASSERT_GE(made, 2);
  EXPECT_LE(made, 4);  // ten keyframes after one, its pose has settled
  EXPECT_EQ(DepthRecording(file).Estimated().front(), 100);
  EXPECT_TRUE(LiveEstimate::FromText(DepthRecording(file).Settings(101)));
  const DepthMap depth = DepthRecording(file).Estimate(101);
  EXPECT_NEAR(depth.depth.at<float>(30, 80), TrueDepth(world, depth.camera, path[1], 80, 30), 0.06);

  Trajectory trajectory;  // nothing moved since: all of them hold
  for (int i = 0; i < kFrames; ++i) {
    trajectory.push_back({i / 30.0, path[static_cast<std::size_t>(i)]});
  }
  WriteTrajectory(folder.Path() / "trajectory.txt", trajectory);
  const DensifySummary final = Densify({.result = folder.Path(), .images = {}, .options = options},
                                       [](int, int, const std::string&) { return true; });
  EXPECT_EQ(final.live, made);
}

}  // namespace
}  // namespace sqslam::testing
