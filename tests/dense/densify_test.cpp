#include "slam/dense/densify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "slam/io/point_cloud.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "tests/dense/true_result.h"
#include "tests/io/captured_log.h"

namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kFrames = 13;

std::string Bytes(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

DensifySummary MakeDense(const fs::path& result, int threads = 1, const fs::path& images = {}) {
  DensifyRequest request{result, images, {}, threads};
  request.options.views.min_overlap = 0.3;
  request.options.stereo.planes = 48;
  return Densify(request, [](int, int, const std::string&) { return true; });
}

TEST(Densify, PlacesPointsOnSurfaces) {
  const TrueResult result(Pan(kFrames, 0.06));
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

TEST(Densify, CloudDoesNotDependOnThreads) {
  const TrueResult result(Pan(kFrames, 0.06));
  MakeDense(result.Path(), 1);
  const std::string first = Bytes(result.Path() / "dense.ply");
  const TrueResult again(Pan(kFrames, 0.06));
  MakeDense(again.Path(), 3);
  EXPECT_TRUE(first == Bytes(again.Path() / "dense.ply"));
}

TEST(Densify, ResumesWhenStopped) {
  const TrueResult result(Pan(kFrames, 0.06));
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

TEST(Densify, LeavesBoxesOfPeopleWithoutDepth) {
  const TrueResult result(Pan(kFrames, 0.06));
  std::string boxes;
  for (int i = 0; i < kFrames; ++i) {
    boxes += std::to_string(i / 30.0) + " person 0.9 100 60 80 100\n";
  }
  WriteFileAtomically(result.Path() / "boxes.txt", boxes);
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

TEST(Densify, NamesMissingImagesAndFindsMovedOnes) {
  const TrueResult result(Pan(kFrames, 0.06));
  const TemporaryFolder elsewhere;
  fs::copy(result.Images().Path(), elsewhere.Path() / "moved", fs::copy_options::recursive);
  fs::remove_all(result.Images().Path() / "rgb");
  EXPECT_THAT(MessageOf<InputError>([&] { MakeDense(result.Path()); }),
              HasSubstr("rgb/0000.jpg, expected them there"));
  fs::remove_all(result.Images().Path());
  EXPECT_THAT(MessageOf<InputError>([&] { MakeDense(result.Path()); }),
              HasSubstr("expected them at " + result.Images().Path().string() + " or with --images"));
  EXPECT_EQ(RecordingReader(result.Path() / "map.sqmap").Size(), 1);
  EXPECT_EQ(MakeDense(result.Path(), 1, elsewhere.Path() / "moved").estimated, 7);
}

TEST(Densify, SkipsKeyframesBeyondShortenedSequence) {
  const TrueResult result(Pan(kFrames, 0.06));
  result.Images().List({0, 1, 2, 3, 4, 5, 6, 7, 8});
  const CapturedLog log;
  const DensifySummary summary = MakeDense(result.Path());
  EXPECT_EQ(summary.keyframes, 7);
  EXPECT_EQ(summary.without, 2);
  EXPECT_EQ(summary.estimated, 5);
  EXPECT_THAT(log.Text(), HasSubstr("2 of 7 keyframes get no new depth, since they lie beyond the 9 images"));
}

TEST(Densify, RefusesImagesNumberedDifferently) {
  const TrueResult result(Pan(kFrames, 0.06));
  MapSnapshot map = *RecordingReader(result.Path() / "map.sqmap").Last();
  map.frame_index = 6;
  map.image_path = result.Images().Image(6).string();
  AppendToRecording(result.Path() / "map.sqmap", map);
  result.Images().List({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12});
  EXPECT_THAT(MessageOf<InputError>([&] { MakeDense(result.Path()); }),
              HasSubstr("0006.jpg is image 5 there (from 0), but image 6 of the map"));
  result.Images().List({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12});
  EXPECT_EQ(MakeDense(result.Path()).estimated, 7);
}

TEST(Densify, SkipsOnlyKeyframeOfUnreadableImage) {
  const TrueResult result(Pan(kFrames, 0.06));
  std::ofstream(result.Images().Image(6)) << "no image";
  const DensifySummary summary = MakeDense(result.Path());
  EXPECT_EQ(summary.without, 1);
  EXPECT_EQ(summary.estimated, 6);
}

TEST(Densify, ReportsCameraWithoutSidewaysMotion) {
  const TrueResult result(Pan(kFrames, 0.0001));
  EXPECT_THAT(MessageOf<NoMapError>([&] { MakeDense(result.Path()); }),
              HasSubstr("expected a camera that moves sideways"));
  EXPECT_FALSE(fs::exists(result.Path() / "dense.ply"));
}

TEST(Densify, NeedsThreeKeyframes) {
  const TrueResult three(Pan(kFrames, 0.06), 6);
  EXPECT_GT(MakeDense(three.Path()).complete, 0.3);
  const TrueResult two(Pan(kFrames, 0.06), 12);
  EXPECT_THAT(MessageOf<NoMapError>([&] { MakeDense(two.Path()); }), HasSubstr("expected"));
}

TEST(Densify, RefusesFolderWithoutMap) {
  const TemporaryFolder folder;
  EXPECT_THAT(MessageOf<InputError>([&] { MakeDense(folder.Path()); }), HasSubstr("map.sqmap"));
}

}  // namespace
}  // namespace sqslam::testing
