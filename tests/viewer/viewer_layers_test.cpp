// Layers of the map, and the copied command, which draws what the window shows.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <Eigen/Geometry>
#include <chrono>
#include <thread>

#include "app/viewer/state/layers.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "tests/viewer/ui_stage.h"
#include "tests/viewer/viewer_program.h"

namespace sqslam::viewer {
namespace {
namespace fs = std::filesystem;

using ::sqslam::testing::ProgramRun;
using ::sqslam::testing::Slurp;
using ::testing::HasSubstr;
using ::testing::Not;

// The command that the viewer offers draws what the viewer's own picture shows.
TEST_F(ViewerScript, CopiesCommandOfSamePicture) {
  WriteGrowingMap(folder_.Path());
  const ProgramRun run = Play(
      "wait idle\nmove 300 250\npress left\nmove 380 230\nrelease left\n"
      "key Left\nkey Left\nwait idle\n"
      "key F12\nframes 2\ncommand command.txt\nclose\n",
      "desk");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string command = Slurp(folder_.Path() / "command.txt");
  EXPECT_THAT(command, HasSubstr("--at-frame="));
  ExpectSamePicture(command);
}

// A sequence whose true camera path is that of the hand-made map, in a world of other scale and frame.
void WriteTruth(const TemporaryFolder& folder) {
  const Sim3d S_world_map{
      2.0, Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX())), {3.0, 2.0, 1.0}};
  std::string images;
  std::string poses;
  for (const SnapshotKeyframe& keyframe : HandMadeMap().keyframes) {
    const Eigen::Vector3d p = S_world_map * keyframe.T_map_camera.translation;
    images += fmt::format("{:.6f} {}.png\n", keyframe.timestamp, keyframe.id);
    poses += fmt::format("{:.6f} {:.9f} {:.9f} {:.9f} 0 0 0 1\n", keyframe.timestamp, p.x(), p.y(), p.z());
  }
  std::filesystem::create_directories(folder.Path() / "sequence");
  folder.Write("sequence/rgb.txt", images);
  folder.Write("sequence/groundtruth.txt", poses);
  folder.Write("sequence/camera.yaml",
               "width: 320\nheight: 240\nfx: 300\nfy: 300\ncx: 159.5\ncy: 119.5\nfps: 3\n"
               "distortion: [0, 0, 0, 0, 0]\n");
}

// Layers of all kinds and a section: on by keys, options and a drop, in the window and in the copied command.
TEST_F(ViewerScript, CopiesCommandWithLayers) {
  WriteTruth(folder_);
  WriteGrowingMap(folder_.Path(), (folder_.Path() / "sequence").string());
  std::string cloud =
      "ply\nformat ascii 1.0\nelement vertex 400\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
  for (int i = 0; i < 400; ++i) {
    cloud += fmt::format("{:.3f} 0.8 {:.3f} 200 60 {}\n", -0.6 + 0.06 * (i % 20), 0.04 * (i / 20), i % 250);
  }
  folder_.Write("room.ply", cloud);
  const ProgramRun run = Play(
      "wait idle\nexpect true_path no\nexpect cloud 0\n"
      "key P\nwait idle\nexpect true_path yes\n"
      "drop " +
          (folder_.Path() / "room.ply").string() +
          "\nframes 2\nwait idle\nexpect cloud 400\n"
          "key G\nkey X\nwait idle\nexpect covisibility yes\nexpect cut view\n"
          "key T\nwait idle\nexpect cut view\n"
          "expect error none\npicture window.png\n"
          "key F12\nframes 2\ncommand command.txt\nclose\n",
      "desk");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string command = Slurp(folder_.Path() / "command.txt");
  EXPECT_THAT(command, HasSubstr("--ground-truth=auto"));
  EXPECT_THAT(command, HasSubstr("--dense-cloud="));
  ExpectSamePicture(command);
}

// A green wall behind the desk, as densifying a map leaves it in the recording.
void AddWall(const fs::path& recording) {
  DepthMap wall;
  wall.camera = {64, 48, 60.0, 60.0, 31.5, 23.5, {}, 30.0};
  wall.T_map_camera = {Eigen::Quaterniond(Eigen::AngleAxisd(-0.5 * M_PI, Eigen::Vector3d::UnitX())),
                       {0.0, -1.5, 0.3}};
  wall.depth = cv::Mat(48, 64, CV_32F, cv::Scalar(2.3));
  wall.views = cv::Mat(48, 64, CV_8U, cv::Scalar(3));
  wall.bgr = cv::Mat(48, 64, CV_8UC3, cv::Scalar(0, 255, 0));
  DepthRecording depths(recording, DepthRecording::Access::kWrite);
  depths.PutEstimate(wall, "settings");
  depths.PutKept(wall);
}

int GreenPixels(const fs::path& picture) {
  cv::Mat green;
  cv::inRange(cv::imread(picture.string()), cv::Scalar(0, 120, 0), cv::Scalar(60, 255, 60), green);
  return cv::countNonZero(green);
}

TEST_F(ViewerScript, ShowsMeshOfDensifiedMapByStyle) {
  Document document;
  document.file = WriteGrowingMap(folder_.Path());
  AddWall(document.file);
  document.last = RecordingReader(document.file).Last();
  Layers layers;
  layers.mesh = true;
  LayerSession session;
  Messages messages;
  const auto update = [&] {
    do {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      session.Update(layers, document, messages);
    } while (session.Busy());
    session.Update(layers, document, messages);
  };
  update();
  ASSERT_NE(layers.drawn.dense_mesh, nullptr);
  EXPECT_GT(layers.drawn.dense_mesh->triangles.size(), 500U);
  auto early = std::make_shared<ShownFrame>();
  early->frame_index = document.last->frame_index - 1;
  document.shown = early;
  update();
  ASSERT_NE(layers.drawn.dense_mesh, nullptr);
  EXPECT_EQ(layers.drawn.dense_mesh->frames.size(), layers.drawn.dense_mesh->vertices.size())
      << "a map on its way has what was seen until then";
  EXPECT_NE(layers.drawn.dense_cloud, nullptr);
}

TEST(ViewerFraming, FramesDenseCloudLikePictures) {
  const TemporaryFolder folder;
  const fs::path bare = WriteGrowingMap(folder.Path() / "bare");
  const fs::path dense = WriteGrowingMap(folder.Path() / "dense");
  AddWall(dense);
  UiStage stage;
  const auto open = [&](const fs::path& map) -> const SceneView& {
    stage.viewer->Open(map);
    stage.Settle();
    return stage.State().view;
  };
  const auto of_wall = [](const SceneView& view) {
    return std::ranges::count_if(view.focus.outline,
                                 [](const Eigen::Vector3d& p) { return std::abs(p.y() - 0.8) < 0.01; });
  };
  EXPECT_EQ(of_wall(open(bare)), 0);
  const SceneView& view = open(dense);
  EXPECT_GT(of_wall(view), 20);
  const Camera pinhole = PinholeOf(view.camera, view.size);
  for (const Eigen::Vector3d& p : view.focus.outline) {
    const Eigen::Vector2d pixel = pinhole.Project(PoseOf(view.camera).Inverse() * p);
    EXPECT_TRUE(pixel.minCoeff() > 0.0 && pixel.x() < view.size.width && pixel.y() < view.size.height)
        << pixel.transpose();
  }
}

TEST_F(ViewerScript, CopiesCommandWithDenseCloud) {
  const fs::path map = WriteGrowingMap(folder_.Path());
  AddWall(map);
  const ProgramRun run = Play(
      "wait idle\nexpect cloud not 0\nexpect error none\npicture window.png\n"
      "key F12\nframes 2\ncommand command.txt\nclose\n",
      "desk");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err, "") << "of OpenGL";
  EXPECT_GT(GreenPixels(folder_.Path() / "window.png"), 2000);
  const std::string command = Slurp(folder_.Path() / "command.txt");
  EXPECT_THAT(command, Not(HasSubstr("dense")));
  ExpectSamePicture(command);

  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(map.c_str(), &db), SQLITE_OK);
  sqlite3_exec(db, "UPDATE depth_maps SET kept = x'00'", nullptr, nullptr, nullptr);
  sqlite3_close(db);
  const ProgramRun broken =
      Play("wait idle\nexpect cloud 0\nexpect error not none\nexpect objects 3\nclose\n", "desk");
  EXPECT_EQ(broken.exit_code, 0) << broken.err;
}

TEST_F(ViewerScript, TakesLayersFromCommandLine) {
  WriteTruth(folder_);
  WriteGrowingMap(folder_.Path());
  folder_.Write("room.ply",
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                "property float z\nend_header\n3 2 1\n");
  const ProgramRun run =
      Play("wait idle\nexpect true_path yes\nexpect cloud 1\nexpect error none\nclose\n",
           "desk --ground-truth sequence --dense-cloud room.ply --dense-cloud-frame world");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const ProgramRun none =
      Play("wait idle\nexpect true_path no\nexpect error not none\nclose\n", "desk --ground-truth auto");
  EXPECT_EQ(none.exit_code, 0) << none.err << ": a map that does not say what was mapped";
}

}  // namespace
}  // namespace sqslam::viewer
