#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "run_program.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/recording.h"
#include "tests/render/hand_made_map.h"

namespace sqslam {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::ProgramRun;
using testing::RunProgram;
using testing::Slurp;

// A result folder of a made-up run, and the sequence that it mapped.
class FigureCommandTest : public ::testing::Test {
 protected:
  FigureCommandTest() : result_(folder_.Path() / "run"), sequence_(folder_.Path() / "sequence") {
    std::filesystem::create_directories(result_);
    std::filesystem::create_directories(sequence_);
    MapSnapshot map = HandMadeMap();
    map.image_path = (sequence_ / "frame.png").string();
    TurnTheBook(map);
    map.detections = {{{"book", 0.9, DrawTheBook(map)}, 0}};
    map.frame_index = map.keyframes.back().frame_index;
    for (std::size_t i = 0; i < map.points.size(); ++i) {
      SnapshotPoint& point = map.points[i];
      point.anomaly = point.object_id == 0 ? 0.4F : i % 50 == 1 ? 0.7F : 0.0F;
      point.rejected_by = point.object_id == 0 ? -1 : i % 50 == 1 || i % 50 == 2 ? 0 : -1;
    }
    RecordingWriter writer(result_ / "map.sqmap", {sequence_.string(), "test", ""});
    writer.Add(map);
    writer.Close();
    WriteStatsAndPaths();
    WriteEval(result_, true);
  }

  static void TurnTheBook(MapSnapshot& map) {
    map.objects[0].yaw = 0.5;
    map.objects[0].superquadric.T_map_object.rotation = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ());
  }

  // The top of the book as an image; returns the box around it.
  static Box2d DrawTheBook(const MapSnapshot& map) {
    const PosedSuperquadric& book = map.objects[0].superquadric;
    std::vector<cv::Point> corners;
    for (const Eigen::Vector3d& sign : {Eigen::Vector3d(-1, -1, 1), {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}}) {
      const Eigen::Vector2d pixel = map.camera.Project(
          map.T_map_camera->Inverse() * (book.T_map_object * sign.cwiseProduct(book.shape.half_size)));
      corners.emplace_back(static_cast<int>(std::lround(pixel.x())),
                           static_cast<int>(std::lround(pixel.y())));
    }
    cv::Mat image(240, 320, CV_8UC3, cv::Scalar(200, 210, 220));
    cv::fillConvexPoly(image, corners, cv::Scalar(40, 60, 50));
    cv::imwrite(map.image_path, image);
    const cv::Rect box = cv::boundingRect(corners);
    return {double(box.x), double(box.y), double(box.width), double(box.height)};
  }

  void WriteStatsAndPaths() {
    RunStats stats;
    stats.timing_ms["tracking"] = {12.25, 11.0, 20.0, 30.0, 100};
    stats.timing_ms["mapping.objects"] = {34.5, 33.0, 60.0, 80.0, 10};
    stats.timing_ms["mapping.final"] = {900.0, 900.0, 900.0, 900.0, 1};
    WriteStats(result_ / "stats.json", stats);
    Trajectory estimated;
    std::string truth;
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d p(std::cos(0.1 * i), 0.5 * std::sin(0.1 * i), 0.1 * std::sin(0.3 * i));
      TimedPose pose;
      pose.timestamp = 0.1 * i;
      pose.T_map_camera.translation = p + Eigen::Vector3d(0.0, 0.0, i % 2 == 0 ? 0.01 : -0.01);
      estimated.push_back(pose);
      truth += std::to_string(0.1 * i) + " " + std::to_string(2.0 * p.x()) + " " +
               std::to_string(2.0 * p.y()) + " " + std::to_string(2.0 * p.z()) + " 0 0 0 1\n";
    }
    WriteTrajectory(result_ / "trajectory.txt", estimated);
    folder_.Write("sequence/groundtruth.txt", truth);
    folder_.Write("sequence/rgb.txt", "0.0 frame.png\n");
    folder_.Write("sequence/camera.yaml",
                  "width: 320\nheight: 240\nfx: 300\nfy: 300\ncx: 160\ncy: 120\nfps: 10\n");
  }

  void WriteEval(const std::filesystem::path& result, bool found) {
    const std::string entry = R"({"ground_truth": 7, "name": "red_cup", "label": "cup", "scored": true,)"
                              R"( "iou": 0.625, "iou_ellipsoid": 0.375})";
    folder_.Write(result.filename().string() + "/eval.json",
                  R"({"ground_truth": "desk", "objects": {"matched": [)" + (found ? entry : "") +
                      R"(], "missed": [)" + (found ? "" : entry) + "]}}");
  }

  // Draws into an SVG and returns it.
  std::string Svg(const std::string& arguments) {
    const auto file = folder_.Path() / "figure.svg";
    std::filesystem::remove(file);
    const ProgramRun run = RunProgram("figure " + arguments + " --output " + file.string());
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return Slurp(file);
  }

  TemporaryFolder folder_;
  std::filesystem::path result_;
  std::filesystem::path sequence_;
};

TEST_F(FigureCommandTest, DrawsEveryFigureFromResultFolder) {
  const std::string result = result_.string();
  EXPECT_THAT(Svg("shapes --e1 0.25 --e2 0.75,1"), AllOf(HasSubstr(">0.25<"), HasSubstr(">0.75<")));
  EXPECT_THAT(Svg("compare " + result), AllOf(HasSubstr(">book<"), HasSubstr(">Cuboid<")));
  EXPECT_THAT(Svg("maps " + result + " --boxes --name Desk --title 'A title'"),
              AllOf(HasSubstr(">Desk<"), HasSubstr(">sports ball<"), HasSubstr(">A title<")));
  EXPECT_THAT(Svg("outliers " + result + " --object 0"),
              AllOf(HasSubstr(">book<"), HasSubstr(" isolated, "), HasSubstr(">removed above 0.65<")));
  EXPECT_THAT(Svg("outliers " + result + " --no-images"), Not(HasSubstr(">no image<")));
  EXPECT_THAT(Svg("timing " + result),
              AllOf(HasSubstr(">objects<"), HasSubstr(">34.5<"), Not(HasSubstr(">final<"))));
  EXPECT_THAT(Svg("timing " + result + " --stage mapping.final"), HasSubstr(">final<"));
  EXPECT_THAT(Svg("iou " + result), AllOf(HasSubstr(">red cup<"), HasSubstr(">0.62<")));
}

// The number after the n-th "mean angle " of an SVG.
double MeanAngle(const std::string& svg, int n) {
  const std::string words = ">mean angle ";
  std::size_t at = 0;
  for (int i = 0; i < n; ++i) {
    at = svg.find(words, at) + words.size();
  }
  return at < svg.size() ? std::stod(svg.substr(at)) : -1.0;
}

TEST_F(FigureCommandTest, AlignsAxesWithLinesInYawFigure) {
  for (const char* choice : {"", " --object 0", " --object 0 --frame 70"}) {
    const std::string svg = Svg("yaw " + result_.string() + choice);
    EXPECT_THAT(svg, AllOf(HasSubstr(">book<"), HasSubstr(" lines<"), HasSubstr("yaw 28.6°<")));
    EXPECT_GT(MeanAngle(svg, 1), 15.0);
    EXPECT_LT(MeanAngle(svg, 2), 2.0);
    EXPECT_GE(MeanAngle(svg, 2), 0.0);
  }
}

// Returns the height on the page of the first text with this content, points from the top.
double HeightOf(const std::string& svg, const std::string& text) {
  const std::size_t at = svg.find(">" + text + "<");
  return std::stod(svg.substr(svg.find(' ', svg.rfind("translate(", at))));
}

TEST_F(FigureCommandTest, PointsUpwardsWithAxisZOfYawFigure) {
  const std::string svg = Svg("yaw " + result_.string());
  EXPECT_LT(HeightOf(svg, "z"), HeightOf(svg, "x"));
  EXPECT_LT(HeightOf(svg, "z"), HeightOf(svg, "y"));
}

TEST_F(FigureCommandTest, SaysInLegendWhatIsAligned) {
  std::filesystem::copy(result_, folder_.Path() / "again");
  const std::filesystem::path other = folder_.Path() / "other";
  std::filesystem::create_directories(other);
  std::filesystem::copy(result_ / "trajectory.txt", other / "trajectory.txt");
  RecordingWriter writer(other / "map.sqmap", {"elsewhere", "test", ""});
  writer.Add(HandMadeMap());
  writer.Close();
  const std::string svg = Svg("trajectory " + result_.string() + " " + (folder_.Path() / "again").string() +
                              " " + other.string());
  EXPECT_THAT(svg, HasSubstr(">run<"));
  EXPECT_THAT(svg, HasSubstr(">again (aligned, 0 map units RMSE)<"));
  EXPECT_THAT(svg, HasSubstr(">other (aligned, another sequence, 0 map units RMSE)<"));
}

TEST_F(FigureCommandTest, DrawsOnlyChosenAndEditedObjects) {
  const std::string maps = "maps " + result_.string() + " --no-images --labels ";
  EXPECT_THAT(Svg(maps), AllOf(HasSubstr(">book<"), HasSubstr(">cup<"), HasSubstr(">sports ball<")));
  EXPECT_THAT(Svg(maps + "--objects 'sports ball,0'"),
              AllOf(HasSubstr(">book<"), Not(HasSubstr(">cup<")), HasSubstr(">sports ball<")));
  const auto edits =
      folder_.Write("edits.json", R"({"format": "sqslam-edits", "version": 1, "objects": [)"
                                  R"({"id": 1, "name": "Ada mug"}, {"id": 0, "deleted": true}]})");
  EXPECT_THAT(Svg(maps + "--edits " + edits.string()),
              AllOf(Not(HasSubstr(">book<")), HasSubstr(">Ada mug<"), HasSubstr(">sports ball<")));
  const ProgramRun run = RunProgram("figure " + maps + "--objects 0,lamp -o x.svg");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("--objects lamp: no such object is left"));
}

TEST_F(FigureCommandTest, ShowsTrajectoryErrorInLegend) {
  const std::string svg =
      Svg("trajectory " + result_.string() + " --heights --ground-truth " + sequence_.string());
  EXPECT_THAT(svg, AllOf(HasSubstr(">ground truth<"), HasSubstr(">run (ATE 2.0 cm)<"), HasSubstr("z [m]")))
      << "10 mm off in a map of half the size";
  EXPECT_THAT(Svg("trajectory " + result_.string()), HasSubstr("x [map units]"));
  StoreMapScale(result_ / "map.sqmap", MapScale{2.0, 0.1, "a door"});
  EXPECT_THAT(Svg("trajectory " + result_.string()), HasSubstr("x [m]"));
  EXPECT_THAT(Svg("trajectory " + (result_ / "trajectory.txt").string()), HasSubstr("x [m]"));
}

TEST_F(FigureCommandTest, DrawsResultsSideBySide) {
  WriteEval(folder_.Path() / "other", false);
  EXPECT_THAT(
      Svg("iou " + result_.string() + " " + (folder_.Path() / "other").string() + " --name A --name B"),
      AllOf(HasSubstr(">A: mean 0.62 of 1, 1 found: 0.62<"), HasSubstr(">B: mean 0.00 of 1, none found<"),
            HasSubstr(">not found<"), HasSubstr(">0.00<")));
}

TEST_F(FigureCommandTest, DrawsPlaceFarFromOrigin) {
  const auto path = folder_.Write("far/trajectory.txt", "0 1e9 0 0 0 0 0 1\n");
  const auto file = folder_.Path() / "far.svg";
  const ProgramRun run = RunProgram("figure trajectory " + path.string() + " --output " + file.string(),
                                    "ulimit -v 6000000; ulimit -t 60");  // its ticks once took all memory
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(Slurp(file), HasSubstr(">x [map units]<"));
}

TEST_F(FigureCommandTest, DrawsFolderNamedInLatin1) {
  const std::filesystem::path other = folder_.Path() / "caf\xe9";
  std::filesystem::copy(result_, other, std::filesystem::copy_options::recursive);
  const std::string timing = "timing " + result_.string() + " " + other.string() + " --title 'No\xebl'";
  EXPECT_THAT(Svg(timing), AllOf(HasSubstr(">caf\xef\xbf\xbd<"), HasSubstr(">No\xef\xbf\xbdl<")));
  const ProgramRun run = RunProgram("figure " + timing + " -o " + (folder_.Path() / "figure.png").string());
  EXPECT_EQ(run.exit_code, 0) << run.err;
}

TEST_F(FigureCommandTest, DrawsOutliersOfObjectsWithImages) {
  EXPECT_THAT(Svg("outliers " + result_.string()),
              AllOf(HasSubstr(">book<"), Not(HasSubstr(">cup<")), Not(HasSubstr(">no image<"))));
  EXPECT_THAT(Svg("outliers " + result_.string() + " --no-images"), HasSubstr(">cup<"));
}

TEST_F(FigureCommandTest, ListsObjectsWhenIdIsUnknown) {
  const ProgramRun run = RunProgram("figure compare " + result_.string() + " --object 9 --output /tmp/x.png");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, AllOf(HasSubstr("no object 9"), HasSubstr("0 book, 1 cup, 2 sports_ball")));
}

TEST_F(FigureCommandTest, ReportsWrongInputInOneLine) {
  struct Case {
    std::string arguments;
    int exit_code;
    std::string message;
  };
  const std::string out = " --output " + (folder_.Path() / "x.png").string();
  const std::string result = result_.string();
  const std::vector<Case> cases = {
      {"maps " + (folder_.Path() / "missing").string() + out, 3, "missing"},
      {"timing " + (folder_.Path() / "missing").string() + out, 3, "missing"},
      {"iou " + sequence_.string() + out, 3, "sqslam eval RESULT"},
      {"iou " + (result_ / "stats.json").string() + out, 3, "expected an eval.json"},
      {"trajectory " + result + " --ground-truth " + result + out, 3, "expected"},
      {"timing " + result + " --stage nothing" + out, 3, "mapping.final, mapping.objects, tracking"},
      {"maps " + result + " --name A --name B" + out, 2, "one for each result"},
      {"maps " + result + " --output " + (folder_.Path() / "x.jpg").string(), 2, ".png, .svg or .pdf"},
      {"maps " + result + " --resolution 12" + out, 2, "expected W,H"},
      {"maps " + result + " --set objects.opacty=1" + out, 2, "objects.opacity"},
      {"outliers " + (folder_.Path() / "missing").string() + out, 3, "missing"},
      {"outliers " + result + " --object 9" + out, 3, "0 book, 1 cup, 2 sports_ball"},
      {"outliers " + result + " --object 0 --frame 3" + out, 3, "keyframe 3, expected one of 70"},
      {"outliers " + result + " --no-images --frame 70" + out, 2, "--no-images"},
      {"yaw " + result + " --object 9" + out, 3, "0 book, 1 cup, 2 sports_ball"},
      {"yaw " + result + " --object 1" + out, 3, "cup): no keyframe with its image"},
      {"yaw " + result + " --object 0 --frame 3" + out, 3, "keyframe 3, expected one of 70"},
      {"yaw " + result + " --frame 70" + out, 2, "--frame without --object"},
      {"shapes --e1 0" + out, 2, "0.05 to 2"},
      {"shape" + out, 2, "did you mean 'shapes'?"},
      {"histogram" + out, 2, "shapes, compare, maps"},
  };
  for (const Case& c : cases) {
    const ProgramRun run = RunProgram("figure " + c.arguments);
    EXPECT_EQ(run.exit_code, c.exit_code) << c.arguments << "\n" << run.err;
    EXPECT_THAT(run.err, HasSubstr(c.message)) << c.arguments;
    EXPECT_EQ(run.ErrorLines().size(), 1u) << run.err;
    EXPECT_FALSE(std::filesystem::exists(folder_.Path() / "x.png"));
  }
}

TEST_F(FigureCommandTest, ShowsExamplesInHelp) {
  for (const char* name :
       {"", "shapes", "compare", "maps", "trajectory", "timing", "iou", "outliers", "yaw"}) {
    const ProgramRun run = RunProgram(std::string("figure ") + name + " --help");
    EXPECT_EQ(run.exit_code, 0);
    EXPECT_THAT(run.out, HasSubstr("Examples:"));
  }
}

}  // namespace
}  // namespace sqslam
