// The program itself under Xvfb, moved by scripts of events.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <Eigen/Geometry>
#include <chrono>
#include <cmath>
#include <thread>

#include "app/viewer/state/layers.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "tests/app/run_program.h"
#include "tests/app/written_sequence.h"
#include "tests/render/baseline.h"
#include "tests/viewer/ui_stage.h"

namespace sqslam::viewer {
namespace {
namespace fs = std::filesystem;

using ::sqslam::testing::ProgramRun;
using ::sqslam::testing::RunProgram;
using ::sqslam::testing::Slurp;
using ::testing::HasSubstr;
using ::testing::Not;

// Runs the viewer in a folder, on a display of its own unless `display` is false.
ProgramRun RunViewer(const TemporaryFolder& folder, const std::string& arguments, bool display = true) {
  const std::string out = (folder.Path() / "out").string();
  const std::string err = (folder.Path() / "err").string();
  // Its own exit code: that of xvfb-run is another one where its cleaning up fails.
  const std::string inner =
      std::string("'") + SQSLAM_VIEWER + " " + arguments + " >" + out + " 2>" + err + "; echo $? >code'";
  const std::string prefix = display ? "xvfb-run -a -s '-screen 0 1280x1024x24' " : "env -u DISPLAY ";
  const std::string command =
      "cd " + folder.Path().string() + " && " + prefix + "sh -c " + inner + " >/dev/null 2>&1";
  if (std::system(command.c_str()) == -1) {
    return {};
  }
  const std::string code = Slurp(folder.Path() / "code");
  return {code.empty() ? -1 : std::stoi(code), Slurp(out), Slurp(err)};
}

class ViewerScript : public ::testing::Test {
 protected:
  ProgramRun Play(const std::string& script, const std::string& arguments) {
    folder_.Write("script.txt", script);
    return RunViewer(folder_, arguments + " --resolution 960,600 --play-events script.txt");
  }
  // Compares what a copied command draws with the picture that F12 left in the folder.
  void ExpectSamePicture(std::string command) {
    ASSERT_TRUE(command.starts_with("sqslam "));
    const std::string output = (folder_.Path() / "headless.png").string();
    command = command.substr(7, command.find('\n') - 7);
    const std::size_t name = command.find("--output=map.png");
    ASSERT_NE(name, std::string::npos);
    command.replace(name, 16, "--output=" + output);
    const ProgramRun headless = RunProgram(command);
    ASSERT_EQ(headless.exit_code, 0) << headless.err;
    cv::Mat shot;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.Path())) {
      if (entry.path().filename().string().ends_with("-1.png")) {
        shot = cv::imread(entry.path().string());
      }
    }
    const cv::Mat drawn = cv::imread(output);
    ASSERT_EQ(shot.size(), drawn.size());
    EXPECT_LT(PictureDifference(shot, drawn), 0.01);
  }

  TemporaryFolder folder_;
};

TEST_F(ViewerScript, OpensScrubsPicksResizesAndCloses) {
  WriteGrowingMap(folder_.Path());
  const ProgramRun run = Play(
      "wait idle\n"
      "expect objects 3\n"
      "expect frame 70\n"
      "move 560 560\npress left\nrelease left\nwait idle\n"
      "expect frame not 70\n"
      "key End\nwait idle\n"
      "expect frame 70\n"
      "key 7\nwait idle\n"
      "expect preset top\n"
      "key 0\nkey T\nwait idle\n"
      "expect style paper\n"
      "resize 0 0\nframes 5\nresize 900 560\nframes 3\nwait idle\n"
      "picture window.png\n"
      "close\n",
      "desk");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  EXPECT_EQ(cv::imread((folder_.Path() / "window.png").string()).size(), cv::Size(900, 560));
}

TEST_F(ViewerScript, RoundsAreRepeatedUntilTheirTimeIsOver) {
  WriteGrowingMap(folder_.Path());
  // The first round switches the help on, the second off again: an end after one round is seen here.
  const ProgramRun run = Play("wait idle\nexpect help no\nkey H\nframes 2\nrepeat 60\nclose\n", "desk");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("script.txt:2: help is yes, expected no"));
  EXPECT_EQ(Play("wait idle\nexpect help no\nkey H\nframes 2\nrepeat 0\nclose\n", "desk").exit_code, 0);
}

TEST_F(ViewerScript, AMinimisedWindowCannotBeWritten) {
  WriteGrowingMap(folder_.Path());
  const ProgramRun run = Play("wait idle\nresize 0 0\nframes 3\npicture window.png\nclose\n", "desk");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("window.png: the window is minimised"));
}

TEST_F(ViewerScript, ADamagedStateOfTheMapCostsOnlyItself) {
  const fs::path map = WriteGrowingMap(folder_.Path());
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(map.c_str(), &db), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(db, "UPDATE snapshots SET data=x'00' WHERE id=1", nullptr, nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(db);
  const ProgramRun run = Play(
      "wait idle\n"
      "expect error not none\n"
      "expect objects 3\n"
      "key Home\nwait idle\n"
      "expect objects 0\n"
      "key End\nwait idle\n"
      "expect objects 3\nclose\n",
      "desk");
  EXPECT_EQ(run.exit_code, 0) << run.err;
}

TEST_F(ViewerScript, WhatIsNotAsExpectedEndsItWithTheLine) {
  WriteGrowingMap(folder_.Path());
  const ProgramRun run = Play("wait idle\nexpect objects 4\n", "desk");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("script.txt:2: objects is 3, expected 4"));
}

// The command that the viewer offers draws what the viewer's own picture shows.
TEST_F(ViewerScript, TheCopiedCommandDrawsTheSamePicture) {
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
TEST_F(ViewerScript, LayersAreSwitchedOnAndTheCopiedCommandDrawsThemToo) {
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

TEST_F(ViewerScript, ADensifiedMapIsAMeshWhereTheStyleSaysSo) {
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

TEST(ViewerFraming, HoldsTheDenseCloudAsPicturesDo) {
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

TEST_F(ViewerScript, ADensifiedMapShowsItsCloudAndTheCopiedCommandDrawsItToo) {
  const fs::path map = WriteGrowingMap(folder_.Path());
  AddWall(map);
  const ProgramRun run = Play(
      "wait idle\nexpect cloud not 0\nexpect error none\npicture window.png\n"
      "key F12\nframes 2\ncommand command.txt\nclose\n",
      "desk");
  ASSERT_EQ(run.exit_code, 0) << run.err;
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

TEST_F(ViewerScript, LayersCanBeAskedForOnTheCommandLine) {
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

TEST_F(ViewerScript, WhatWasRecordedPlaysAgain) {
  WriteGrowingMap(folder_.Path());
  const ProgramRun first = Play("wait idle\nkey 3\nframes 4\nclose\n", "desk --record-events log.txt");
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const std::string log = Slurp(folder_.Path() / "log.txt");
  EXPECT_THAT(log, HasSubstr("keydown 3\n"));
  const std::string before_close = log.substr(0, log.find("close"));
  const ProgramRun again = Play("wait idle\n" + before_close + "expect preset right\nclose\n", "desk");
  EXPECT_EQ(again.exit_code, 0) << again.err;
}

// A camera that moves sideways past a textured world.
std::vector<Rigid3d> Sideways(int frames) {
  std::vector<Rigid3d> poses;
  for (int i = 0; i < frames; ++i) {
    poses.push_back({Eigen::Quaterniond::Identity(), {0.03 * i, 0.004 * i, 0.0}});
  }
  return poses;
}

TEST_F(ViewerScript, ClosingWhileMappingEndsTheRunAndSavesIt) {
  const sqslam::testing::WrittenSequence sequence(Sideways(360));
  folder_.Write("growth.mp4", "of an earlier run");
  const ProgramRun run =
      Play("wait map\nframes 2\nkey Space\nframes 5\nclose\n",
           "run " + sequence.Path().string() + " --realtime --video growth.mp4 --output result");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  for (const char* name : {"map.sqmap", "points.ply", "stats.json", "map.png"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_.Path() / "result" / name)) << name;
  }
  EXPECT_THAT(Slurp(folder_.Path() / "result" / "stats.json"), HasSubstr("\"interrupted\": true"));
  EXPECT_EQ(Slurp(folder_.Path() / "result" / "report.html").find("<video"), std::string::npos);
}

TEST_F(ViewerScript, ARunThatEndsIsShownAsARecording) {
  const sqslam::testing::WrittenSequence sequence(Sideways(40));
  const ProgramRun run = Play(
      "wait map\nwait end\nwait idle\nexpect running no\nexpect image yes\nexpect error none\n"
      "picture outside.png\nkey C\nframes 5\nwait idle\npicture through.png\nclose\n",
      "run " + sequence.Path().string() + " --output result");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(Slurp(folder_.Path() / "result" / "stats.json"), HasSubstr("\"interrupted\": false"));
  // Through the camera its photograph lies beneath; the bare scene is dark.
  const auto brightness = [&](const char* picture) {
    return cv::mean(cv::imread((folder_.Path() / picture).string())(cv::Rect(120, 120, 300, 220)))[1];
  };
  EXPECT_GT(brightness("through.png"), 2.0 * brightness("outside.png"));
}

TEST_F(ViewerScript, AFailureAtTheStartOfARunStaysInTheWindowAndGoesToTheTerminal) {
  folder_.Write("empty/notes.txt", "no image");
  const ProgramRun run = Play("wait end\nframes 30\nexpect failure not none\nexpect running no\nclose\n",
                              "run empty --output result");
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  EXPECT_THAT(run.err, HasSubstr("empty: no rgb.txt"));
}

TEST_F(ViewerScript, WithoutADisplayOneLineSaysWhatToDoInstead) {
  const ProgramRun run = RunViewer(folder_, "some/map.sqmap", false);
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("`sqslam render some/map.sqmap --output map.png`"));
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1);
}

TEST_F(ViewerScript, WrongUsageIsRefusedBeforeAWindowOpens) {
  EXPECT_EQ(RunViewer(folder_, "--resolution 1,1 map.sqmap").exit_code, 2);
  EXPECT_EQ(RunViewer(folder_, "run --nothing").exit_code, 2);
  EXPECT_EQ(RunViewer(folder_, "run").exit_code, 2);
}

// OSMesa would take the OpenGL of the window away (render/CMakeLists.txt).
TEST(ViewerProgram, DoesNotLinkOsmesa) {
  const TemporaryFolder folder;
  const std::string list = (folder.Path() / "list").string();
  ASSERT_EQ(std::system((std::string("ldd ") + SQSLAM_VIEWER + " >" + list).c_str()), 0);
  EXPECT_THAT(Slurp(list), HasSubstr("libglfw"));
  EXPECT_THAT(Slurp(list), Not(HasSubstr("OSMesa")));
}

}  // namespace
}  // namespace sqslam::viewer
