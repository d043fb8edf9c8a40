// The program itself under Xvfb, moved by scripts of events.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <algorithm>

#include "tests/app/written_sequence.h"
#include "tests/viewer/ui_stage.h"
#include "tests/viewer/viewer_program.h"

namespace sqslam::viewer {
namespace {
namespace fs = std::filesystem;

using ::sqslam::testing::ProgramRun;
using ::sqslam::testing::Slurp;
using ::testing::HasSubstr;
using ::testing::Not;

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

TEST_F(ViewerScript, ClicksOnLabels) {
  WriteGrowingMap(folder_.Path());
  const ProgramRun run = Play(
      "wait idle\nexpect covisibility no\n"
      "click Window\nclick Image\nclick View\nclick covisibility\nexpect covisibility yes\n"
      "click top\nexpect preset top\n"
      "click Objects\nclick book*\nexpect selected 0\n"
      "click File\nclick Open ...\nclick Close\n"
      "point 300 -20 keyframes\npress left\nrelease left\nwait idle\nexpect frame not 70\nclose\n",
      "desk");
  EXPECT_EQ(run.exit_code, 0) << run.err;
}

TEST_F(ViewerScript, AnswersQuestionsAndFadesOtherObjects) {
  WriteGrowingMap(folder_.Path());
  const ProgramRun run = Play(
      "wait idle\nexpect answers none\npicture before.png\n"
      "click Objects\nclick search\ntext largest thing\nframes 3\nwait idle\n"
      "expect answers 0\npicture largest.png\n"
      "keydown Control\nkey A\nkeyup Control\ntext cupz\nframes 3\nwait idle\nexpect answers none\n"
      "keydown Control\nkey A\nkeyup Control\ntext cup\nframes 3\nwait idle\nexpect answers none\n"
      "picture words.png\nclose\n",
      "desk");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const auto scene = [&](const char* name) {
    return cv::imread((folder_.Path() / name).string())(cv::Rect(0, 40, 520, 400)).clone();
  };
  EXPECT_GT(PictureDifference(scene("before.png"), scene("largest.png")), 0.005);
  EXPECT_LT(PictureDifference(scene("before.png"), scene("words.png")), 0.001);
}

TEST_F(ViewerScript, TellsWhatMeasuringWaitsFor) {
  WriteGrowingMap(folder_.Path());
  const ProgramRun run = Play(
      "wait idle\nexpect hint none\nkey M\nframes 2\n"
      "expect hint Click the first point, on an object or on a point of the map\n"
      "move 20 60\npress left\nrelease left\nframes 2\n"
      "expect hint Nothing there: click on an object or on a point\npicture nothing.png\n"
      "move 265 250\npress left\nrelease left\nframes 2\nexpect hint Click the second point\n"
      "move 300 260\npress left\nrelease left\nframes 2\n"
      "expect hint The next click measures anew; M or Escape ends\n"
      "key M\nframes 2\nexpect hint none\nclose\n",
      "desk");
  EXPECT_EQ(run.exit_code, 0) << run.err;
}

TEST_F(ViewerScript, RepeatsUntilTimeIsOver) {
  WriteGrowingMap(folder_.Path());
  // The first round switches the help on, the second off again: an end after one round is seen here.
  const ProgramRun run = Play("wait idle\nexpect help no\nkey H\nframes 2\nrepeat 60\nclose\n", "desk");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("script.txt:2: help is yes, expected no"));
  EXPECT_EQ(Play("wait idle\nexpect help no\nkey H\nframes 2\nrepeat 0\nclose\n", "desk").exit_code, 0);
}

TEST_F(ViewerScript, ReportsPictureOfMinimisedWindow) {
  WriteGrowingMap(folder_.Path());
  const ProgramRun run = Play("wait idle\nresize 0 0\nframes 3\npicture window.png\nclose\n", "desk");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("window.png: the window is minimised"));
}

TEST_F(ViewerScript, SkipsOnlyDamagedSnapshot) {
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

TEST_F(ViewerScript, EndsWithLineOfFailedExpectation) {
  WriteGrowingMap(folder_.Path());
  const ProgramRun run = Play("wait idle\nexpect objects 4\n", "desk");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("script.txt:2: objects is 3, expected 4"));
}

TEST_F(ViewerScript, ReplaysRecordedEvents) {
  WriteGrowingMap(folder_.Path());
  const ProgramRun first = Play("wait idle\nkey 3\nframes 4\nclose\n", "desk --record-events log.txt");
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const std::string log = Slurp(folder_.Path() / "log.txt");
  EXPECT_THAT(log, HasSubstr("keydown 3\n"));
  const std::string before_close = log.substr(0, log.find("close"));
  const ProgramRun again = Play("wait idle\n" + before_close + "expect preset right\nclose\n", "desk");
  EXPECT_EQ(again.exit_code, 0) << again.err;
}

TEST_F(ViewerScript, ReportsUnwritableFiles) {
  WriteGrowingMap(folder_.Path());
  const ProgramRun picture = Play("wait idle\npicture nowhere/window.png\nclose\n", "desk");
  EXPECT_EQ(picture.exit_code, 3);
  EXPECT_THAT(picture.err, HasSubstr("script.txt:2: nowhere/window.png: cannot be written"));
  const ProgramRun log = Play("wait idle\nclose\n", "desk --record-events /dev/full");
  EXPECT_EQ(log.exit_code, 3);
  EXPECT_THAT(log.err, HasSubstr("/dev/full: cannot be written"));
}

// A camera that moves sideways past a textured world.
std::vector<Rigid3d> Sideways(int frames) {
  std::vector<Rigid3d> poses;
  for (int i = 0; i < frames; ++i) {
    poses.push_back({Eigen::Quaterniond::Identity(), {0.03 * i, 0.004 * i, 0.0}});
  }
  return poses;
}

TEST_F(ViewerScript, SavesRunWhenClosedWhileMapping) {
  const sqslam::testing::WrittenSequence sequence(Sideways(360));
  folder_.Write("growth.mp4", "of an earlier run");
  const ProgramRun run =
      Play("wait map\nframes 2\nkey Space\nframes 5\nclose\n",
           "run " + sequence.Path().string() + " --no-dense --realtime --video growth.mp4 --output result");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  for (const char* name : {"map.sqmap", "points.ply", "stats.json", "map.png"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_.Path() / "result" / name)) << name;
  }
  EXPECT_THAT(Slurp(folder_.Path() / "result" / "stats.json"), HasSubstr("\"interrupted\": true"));
  EXPECT_EQ(Slurp(folder_.Path() / "result" / "report.html").find("<video"), std::string::npos);
}

TEST_F(ViewerScript, ShowsFinishedRunAsRecording) {
  const sqslam::testing::WrittenSequence sequence(Sideways(40));
  const ProgramRun run = Play(
      "wait map\nwait end\nwait idle\nexpect running no\nexpect image yes\nexpect error none\n"
      "picture outside.png\nkey C\nframes 5\nwait idle\npicture through.png\n"
      "key F12\nframes 2\ncommand command.txt\nclose\n",
      "run " + sequence.Path().string() + " --no-dense --output result");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(Slurp(folder_.Path() / "result" / "stats.json"), HasSubstr("\"interrupted\": false"));
  // Through the camera its photograph lies beneath; the bare scene is dark.
  const auto brightness = [&](const char* picture) {
    return cv::mean(cv::imread((folder_.Path() / picture).string())(cv::Rect(120, 120, 300, 220)))[1];
  };
  EXPECT_GT(brightness("through.png"), 2.0 * brightness("outside.png"));
  ExpectSamePicture(Slurp(folder_.Path() / "command.txt"));
  EXPECT_GT(brightness("headless.png"), 2.0 * brightness("outside.png"));
}

TEST_F(ViewerScript, ReportsFailedStartInWindowAndTerminal) {
  folder_.Write("empty/notes.txt", "no image");
  const ProgramRun run = Play("wait end\nframes 30\nexpect failure not none\nexpect running no\nclose\n",
                              "run empty --output result");
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  EXPECT_THAT(run.err, HasSubstr("empty: no rgb.txt"));
}

TEST_F(ViewerScript, NamesHeadlessCommandWithoutDisplay) {
  const ProgramRun run = RunViewer(folder_, "some/map.sqmap", false);
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("`sqslam render some/map.sqmap --output map.png`"));
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1);
}

TEST_F(ViewerScript, RejectsWrongUsageBeforeOpeningWindow) {
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
