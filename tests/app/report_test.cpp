#include "app/report/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "slam/evaluation/evaluation.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/recording.h"
#include "slam/system_options.h"
#include "slam/util/error.h"
#include "slam/util/options.h"
#include "tests/app/run_program.h"
#include "tests/io/temporary_folder.h"
#include "tests/render/hand_made_map.h"

namespace sqslam::app {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;

Trajectory Arc() {
  Trajectory trajectory;
  for (int i = 0; i < 10; ++i) {
    trajectory.push_back({0.1 * i, {Eigen::Quaterniond::Identity(), {0.1 * i, 0.02 * i * i, 0.5}}});
  }
  return trajectory;
}

SnapshotObject Mug() {
  SnapshotObject mug;
  mug.id = 7;
  mug.label = "<mug> & \"spoon\"";
  mug.superquadric = {{{0.04, 0.04, 0.05}, 0.1, 1.0}, {Eigen::Quaterniond::Identity(), {0.3, 0.2, 0.1}}};
  return mug;
}

// A result folder as a run leaves it.
void WriteResult(const fs::path& folder) {
  WriteTrajectory(folder / "trajectory.txt", Arc());
  WriteObjects(folder / "objects.json", {Mug()});
  RunStats stats;
  stats.frames = 10;
  stats.tracked = 9;
  stats.wall_seconds = 2.0;
  stats.timing_ms["tracking"] = {12.5, 11.0, 20.0, 33.0, 10};
  WriteStats(folder / "stats.json", stats);
  cv::imwrite((folder / "map.png").string(), cv::Mat(4, 4, CV_8UC3, cv::Scalar(1, 2, 3)));
  fs::create_directories(folder / "figures");
  cv::imwrite((folder / "figures" / "from_above.png").string(), cv::Mat(4, 4, CV_8UC3, cv::Scalar(9, 9, 9)));
}

TEST(Report, WritesSelfContainedFile) {
  const TemporaryFolder folder;
  WriteResult(folder.Path());
  WriteReport({folder.Path(), "A mug & more", "data/<kitchen>", {}});
  const std::string page = sqslam::testing::Slurp(folder.Path() / "report.html");
  EXPECT_THAT(page, HasSubstr("<h1>A mug &amp; more</h1>"));
  EXPECT_THAT(page, HasSubstr("data/&lt;kitchen&gt;"));
  EXPECT_THAT(page, HasSubstr("&lt;mug&gt; &amp; &quot;spoon&quot;"));
  EXPECT_THAT(page, Not(HasSubstr("<mug>")));
  EXPECT_THAT(page, HasSubstr("90.0"));   // % tracked
  EXPECT_THAT(page, HasSubstr("12.50"));  // ms
  EXPECT_THAT(page, HasSubstr("from above"));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, Not(HasSubstr("<link")));
  for (std::size_t at = page.find("src=\""); at != std::string::npos; at = page.find("src=\"", at + 1)) {
    EXPECT_EQ(page.compare(at, 10, "src=\"data:"), 0) << page.substr(at, 40);
  }
  EXPECT_THAT(page, HasSubstr("map units"));
  EXPECT_THAT(page, Not(HasSubstr("Against the ground truth")));
}

TEST(Report, ShowsEvaluationInMetricUnits) {
  const TemporaryFolder folder;
  WriteResult(folder.Path());
  GroundTruth truth;
  truth.trajectory = Arc();
  for (TimedPose& pose : truth.trajectory) {
    pose.T_map_camera.translation *= 2.0;  // a map unit is two metres
  }
  truth.frames = 10;
  truth.has_objects = true;
  truth.objects = {{1, "white_mug", "cup", {SolidKind::kCylinder, {0.08, 0.08, 0.1}, 0.1, 1.0, {}}, 0, true},
                   {2, "teapot", "teapot", {SolidKind::kEllipsoid, {0.1, 0.1, 0.1}, 1, 1, {}}, 0, true}};
  truth.objects[0].solid.T_map_object.translation = {0.6, 0.4, 0.2};
  truth.objects[1].solid.T_map_object.translation = {9, 9, 9};
  const Evaluation evaluation = Evaluate(Arc(), {Mug()}, truth, {});
  WriteReport({folder.Path(), "", "", {}, nullptr, &evaluation});
  const std::string page = sqslam::testing::Slurp(folder.Path() / "report.html");
  EXPECT_THAT(page, HasSubstr("Against the ground truth"));
  EXPECT_THAT(page, HasSubstr("16.0 × 16.0 × 20.0"));  // cm
  EXPECT_THAT(page, HasSubstr("white mug <span class=\"id\">1</span>"));
  EXPECT_THAT(page, Not(HasSubstr("white_mug")));
  EXPECT_THAT(page,
              HasSubstr("teapot <span class=\"id\">2</span></td><td class=\"wide\">0</td><td class=\"l\" "
                        "colspan=\"7\">missed"));
}

TEST(Report, SplitsTopViewAtTrackingLosses) {
  const auto paths = [](const ReportData& data) {
    const std::string svg = TopViewSvg(data, {});
    int count = 0;
    for (std::size_t at = svg.find("<path"); at != std::string::npos; at = svg.find("<path", at + 1)) {
      ++count;
    }
    return count;
  };
  ReportData data;
  data.trajectory = Arc();
  const int whole = paths(data);
  for (std::size_t i = 5; i < data.trajectory.size(); ++i) {
    data.trajectory[i].timestamp += 30.0;
  }
  EXPECT_EQ(paths(data), whole + 1);
}

// A recording, a run that went badly, and an image that was mapped.
void AddRecording(const fs::path& folder) {
  MapSnapshot map = HandMadeMap();
  map.image_path = (folder / "70.png").string();
  cv::imwrite(map.image_path, cv::Mat(240, 320, CV_8UC3, cv::Scalar(90, 120, 160)));
  map.detections.push_back({{}, 0});
  map.gravity_known = false;
  SystemOptions options;
  options.seed = 12345;
  RecordingWriter writer(folder / "map.sqmap", {"data/desk", "9.8.7", DumpOptions(options)});
  writer.Add(map);
  writer.Close();
  RunStats stats = ReadStats(folder / "stats.json");
  stats.tracked = 3;
  stats.counters.losses = 2;
  stats.submaps = 4;
  stats.detector = "net.onnx";
  stats.detector_frames = 8;
  stats.objects = 3;
  stats.uncertain = 1;
  stats.camera = "a guess from the lens";
  stats.command = "sqslam run 'my film' --seed 12345";
  stats.classes["car"].boxes = 50;
  stats.classes["car"][LeftOut::kMoving] = 2;
  stats.warnings = {"the <camera> turns on the spot"};
  WriteStats(folder / "stats.json", stats);
}

TEST(Report, DescribesRun) {
  const TemporaryFolder folder;
  WriteResult(folder.Path());
  AddRecording(folder.Path());
  WriteReport({folder.Path(), "", "", {}});
  const std::string page = sqslam::testing::Slurp(folder.Path() / "report.html");
  for (const char* told :
       {"Most of this run failed", "Only 3 of 10 frames", "focal length 300.0 px", "a guess from the lens",
        "net.onnx, which saw 8 of 10 frames", "<dd>2<span>1 uncertain, detector saw 8 of 10 frames",
        "2 times", "4 left on their own", ">2 moving</td>", "a map holds what stands still",
        "the map may lean", "sqslam run 'my film' --seed 12345", "sqslam 9.8.7",
        "the &lt;camera&gt; turns on the spot", "<code>seed</code></td><td>12345</td>"}) {
    EXPECT_THAT(page, HasSubstr(told));
  }
}

TEST(Report, ShowsOutlinedInputBeforeMap) {
  const TemporaryFolder folder;
  WriteResult(folder.Path());
  AddRecording(folder.Path());
  WriteReport({folder.Path(), "", "", {}});
  const std::string page = sqslam::testing::Slurp(folder.Path() / "report.html");
  const std::size_t photo = page.find("Frame 70 of the input");
  const std::size_t view = page.find("id=\"sq\"");
  ASSERT_NE(photo, std::string::npos);
  ASSERT_NE(view, std::string::npos);
  EXPECT_LT(photo, view);
  EXPECT_THAT(page, Not(HasSubstr("alt=\"The map\"")));  // the view stands in its place
}

TEST(ReportCommand, ShowsChosenObjectsOnly) {
  using sqslam::testing::RunProgram;
  const TemporaryFolder folder;
  WriteResult(folder.Path());
  AddRecording(folder.Path());
  const std::string report = "report " + folder.Path().string();
  ASSERT_EQ(RunProgram(report).exit_code, 0);
  const std::string whole = sqslam::testing::Slurp(folder.Path() / "report.html");
  EXPECT_THAT(whole, HasSubstr("<h2>Figures</h2>"));
  EXPECT_THAT(whole, HasSubstr("&lt;mug&gt;"));
  const fs::path page = folder.Path() / "cup.html";
  const auto run = RunProgram(report + " --objects cup -o " + page.string());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("written: " + page.string()));
  const std::string chosen = sqslam::testing::Slurp(page);
  EXPECT_THAT(chosen, HasSubstr("<dt>Objects</dt><dd>1<"));
  EXPECT_THAT(chosen, HasSubstr("cup <span class=\"id\">1</span>"));
  EXPECT_THAT(chosen, Not(HasSubstr("&lt;mug&gt;")));
  EXPECT_THAT(chosen, Not(HasSubstr("<h2>Figures</h2>")));
  EXPECT_EQ(RunProgram(report + " --objects lamp").exit_code, 2);
}

TEST(Report, OmitsMissingFilesAndNamesBrokenOnes) {
  const TemporaryFolder folder;
  WriteReport({folder.Path(), "", "", {}});
  EXPECT_THAT(sqslam::testing::Slurp(folder.Path() / "report.html"), Not(HasSubstr("<h2>")));
  std::ofstream(folder.Path() / "stats.json") << "{\"frames\": []}";
  try {
    WriteReport({folder.Path(), "", "", {}});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("stats.json"));
  }
  EXPECT_THROW(WriteReport({folder.Path() / "nowhere", "", "", {}}), InputError);
}

TEST(EvalCommand, WritesEvalJsonAndReportsErrors) {
  using sqslam::testing::RunProgram;
  const TemporaryFolder folder;
  const fs::path result = folder.Path() / "result";
  const fs::path sequence = folder.Path() / "sequence";
  fs::create_directories(result);
  fs::create_directories(sequence);
  WriteResult(result);
  WriteTrajectory(sequence / "groundtruth.txt", Arc());
  const std::string command = "eval " + result.string() + " --ground-truth " + sequence.string();

  const auto missing = RunProgram(command);
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_THAT(missing.err, HasSubstr("rgb.txt"));
  EXPECT_FALSE(fs::exists(result / "eval.json"));

  std::ofstream rgb(sequence / "rgb.txt");
  for (int i = 0; i < 10; ++i) {
    rgb << 0.1 * i << " rgb/" << i << ".png\n";
  }
  rgb.close();
  const auto good = RunProgram(command);
  EXPECT_EQ(good.exit_code, 0) << good.err;
  EXPECT_THAT(good.out, HasSubstr("10 of 10 (100.0 %)"));
  EXPECT_TRUE(fs::exists(result / "eval.json"));

  const auto dense = RunProgram(command + " --dense");
  EXPECT_EQ(dense.exit_code, 3);
  EXPECT_THAT(dense.err, HasSubstr("dense.ply: no such file; expected true surface points"));
  EXPECT_EQ(RunProgram("eval " + result.string()).exit_code, 2);
  EXPECT_EQ(RunProgram(command + " --set min_iuo=0.2").exit_code, 2);
  std::ofstream(sequence / "objects_gt.json") << "[{\"id\": 1}]";
  const auto broken = RunProgram(command);
  EXPECT_EQ(broken.exit_code, 3);
  EXPECT_THAT(broken.err, HasSubstr("objects_gt.json: object 1"));
}

}  // namespace
}  // namespace sqslam::app
