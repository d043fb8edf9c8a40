#include "slam/dense/densify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "slam/io/point_cloud.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "tests/app/written_sequence.h"
#include "tests/dense/panel_world.h"

namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kFrames = 13;

std::string Bytes(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// A pan to the right, six centimetres a frame.
std::vector<Rigid3d> Pan(int frames, double step) {
  std::vector<Rigid3d> path;
  for (int i = 0; i < frames; ++i) {
    path.push_back({Eigen::Quaterniond::Identity(), {step * (i - frames / 2), 0.01 * (i % 3), 0.0}});
  }
  return path;
}

// The result folder of a run that found the truth.
class Result {
 public:
  explicit Result(const std::vector<Rigid3d>& path, int keyframe_interval = 2) : sequence_(path) {
    MapSnapshot map;
    map.camera = world_.GetCamera();
    Trajectory trajectory;
    for (std::size_t i = 0; i < path.size(); ++i) {
      const auto index = static_cast<std::int64_t>(i);
      trajectory.push_back({static_cast<double>(index) / 30.0, path[i]});
      if (index % keyframe_interval == 0) {
        map.keyframes.push_back({100 + index, index, trajectory.back().timestamp, path[i]});
      }
    }
    for (int v = 5; v < 240; v += 15) {
      for (int u = 5; u < 320; u += 15) {
        const double z = TrueDepth(world_, map.camera, path[0], u, v);
        map.points.push_back(
            {(path[0] * Eigen::Vector3d(z * map.camera.Unproject({double(u), double(v)}))).cast<float>(),
             {},
             -1});
      }
    }
    WriteTrajectory(Path() / "trajectory.txt", trajectory);
    RecordingWriter recording(Path() / "map.sqmap", {sequence_.Path().string(), "test", ""});
    recording.Add(map);
  }
  fs::path Path() const { return folder_.Path(); }
  const WrittenSequence& Images() const { return sequence_; }
  const TexturedWorld& World() const { return world_; }

 private:
  const TexturedWorld world_;
  WrittenSequence sequence_;
  TemporaryFolder folder_;
};

DensifySummary MakeDense(const fs::path& result, int threads = 1, const fs::path& images = {}) {
  DensifyRequest request{result, images, {}, threads};
  request.options.views.min_overlap = 0.3;
  request.options.stereo.planes = 48;
  return Densify(request, [](int, int, const std::string&) { return true; });
}

TEST(Densify, PointsLieOnTheSurfacesOfTheWorld) {
  const Result result(Pan(kFrames, 0.06));
  const DensifySummary summary = MakeDense(result.Path());
  EXPECT_EQ(summary.keyframes, 7);
  EXPECT_EQ(summary.estimated, 7);
  EXPECT_GT(summary.complete, 0.7);
  const PointCloud cloud = ReadPointCloud(result.Path() / "dense.ply");
  EXPECT_EQ(cloud.points.size(), summary.points);
  const Camera camera = result.World().GetCamera();
  std::size_t near = 0;
  for (const Eigen::Vector3d& p :
       cloud.points) {  // against the depth that the middle frame truly shows there
    const Eigen::Vector2d pixel = camera.Project(p);
    near +=
        std::abs(TrueDepth(result.World(), camera, {}, pixel.x(), pixel.y()) / p.z() - 1.0) < 0.02 ? 1U : 0U;
  }
  EXPECT_GT(static_cast<double>(near), 0.75 * static_cast<double>(cloud.points.size()));

  const DepthRecording depths(result.Path() / "map.sqmap");
  ASSERT_EQ(depths.Keyframes().size(), 7U);
  const DepthMap map = depths.Kept(106);
  EXPECT_EQ(map.frame_index, 6);
  EXPECT_EQ(map.camera.width, 160);
  EXPECT_NEAR(map.depth.at<float>(30, 80), TrueDepth(result.World(), map.camera, map.T_map_camera, 80, 30),
              0.05);
  EXPECT_EQ(RecordingReader(result.Path() / "map.sqmap").Size(), 1);  // and the map is as it was
}

TEST(Densify, TheCloudIsTheSameWithAnyNumberOfThreads) {
  const Result result(Pan(kFrames, 0.06));
  MakeDense(result.Path(), 1);
  const std::string first = Bytes(result.Path() / "dense.ply");
  const Result again(Pan(kFrames, 0.06));
  MakeDense(again.Path(), 3);
  EXPECT_TRUE(first == Bytes(again.Path() / "dense.ply"));
}

TEST(Densify, GoesOnWhereItWasStopped) {
  const Result result(Pan(kFrames, 0.06));
  DensifyRequest request{result.Path(), {}, {}, 1};
  request.options.views.min_overlap = 0.3;
  request.options.stereo.planes = 48;
  const DensifySummary stopped = Densify(request, [](int done, int, const std::string&) { return done < 3; });
  EXPECT_TRUE(stopped.interrupted);
  EXPECT_EQ(stopped.estimated, 3);
  EXPECT_FALSE(fs::exists(result.Path() / "dense.ply"));
  const DensifySummary rest = MakeDense(result.Path());
  EXPECT_EQ(rest.resumed, 3);
  EXPECT_EQ(rest.estimated, 4);
  const std::string cloud = Bytes(result.Path() / "dense.ply");
  EXPECT_EQ(MakeDense(result.Path()).estimated, 0);
  EXPECT_TRUE(cloud == Bytes(result.Path() / "dense.ply"));

  request.options.stereo.planes = 32;  // other settings: anew
  EXPECT_EQ(Densify(request, [](int, int, const std::string&) { return true; }).estimated, 7);
}

TEST(Densify, BoxesOfPeopleGetNoDepth) {
  const Result result(Pan(kFrames, 0.06));
  std::string boxes;
  for (int i = 0; i < kFrames; ++i) {
    boxes += std::to_string(i / 30.0) + " person 0.9 100 60 80 100\n";
  }
  result.Images().Write("boxes.txt", boxes);
  MakeDense(result.Path());
  const DepthMap map = DepthRecording(result.Path() / "map.sqmap").Kept(106);
  EXPECT_EQ(cv::countNonZero(map.depth(cv::Rect(50, 30, 40, 50)) > 0.0), 0);
  EXPECT_GT(cv::countNonZero(map.depth(cv::Rect(100, 30, 40, 50)) > 0.0), 1000);
}

template <typename Error>
std::string MessageOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& e) {
    return e.what();
  }
  return "(no such error)";
}

TEST(Densify, ImagesThatAreGoneAreNamedAndMayLieElsewhere) {
  const Result result(Pan(kFrames, 0.06));
  const TemporaryFolder elsewhere;
  fs::copy(result.Images().Path(), elsewhere.Path() / "moved", fs::copy_options::recursive);
  fs::remove_all(result.Images().Path() / "rgb");
  EXPECT_THAT(MessageOf<InputError>([&] { MakeDense(result.Path()); }),
              HasSubstr("rgb/0000.jpg, expected them there"));
  fs::remove_all(result.Images().Path());
  EXPECT_THAT(MessageOf<InputError>([&] { MakeDense(result.Path()); }),
              HasSubstr("expected them at " + result.Images().Path().string() + " or by --images"));
  EXPECT_EQ(RecordingReader(result.Path() / "map.sqmap").Size(), 1);
  EXPECT_EQ(MakeDense(result.Path(), 1, elsewhere.Path() / "moved").estimated, 7);
}

TEST(Densify, AnImageThatCannotBeReadCostsItsKeyframeOnly) {
  const Result result(Pan(kFrames, 0.06));
  std::ofstream(result.Images().Image(6)) << "no image";
  const DensifySummary summary = MakeDense(result.Path());
  EXPECT_EQ(summary.without, 1);
  EXPECT_EQ(summary.estimated, 6);
}

TEST(Densify, ACameraThatDoesNotMoveSidewaysGivesNoDepth) {
  const Result result(Pan(kFrames, 0.0001));
  EXPECT_THAT(MessageOf<NoMapError>([&] { MakeDense(result.Path()); }),
              HasSubstr("expected a camera that moves sideways"));
  EXPECT_FALSE(fs::exists(result.Path() / "dense.ply"));
}

TEST(Densify, ThreeKeyframesAreEnoughAndTwoAreNot) {
  const Result three(Pan(kFrames, 0.06), 6);
  EXPECT_GT(MakeDense(three.Path()).complete, 0.3);
  const Result two(Pan(kFrames, 0.06), 12);
  EXPECT_THAT(MessageOf<NoMapError>([&] { MakeDense(two.Path()); }), HasSubstr("expected"));
}

TEST(Densify, AFolderWithoutAMapIsRefused) {
  const TemporaryFolder folder;
  EXPECT_THAT(MessageOf<InputError>([&] { MakeDense(folder.Path()); }), HasSubstr("map.sqmap"));
}

}  // namespace
}  // namespace sqslam::testing
