#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "app/export/map_view.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/sqlite_file.h"
#include "tests/app/run_program.h"
#include "tests/app/written_sequence.h"
#include "tests/render/hand_made_map.h"
#include "tests/support/textured_world.h"

namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The hand-made desk, whose cup is 0.4 map units high.
class ScaleCommand : public ::testing::Test {
 protected:
  ScaleCommand() {
    MapSnapshot map = HandMadeMap();
    for (SnapshotObject& object : map.objects) {
      object.fit.covariance = 1e-6 * Eigen::Matrix<double, 9, 9>::Identity();
    }
    map.objects[2].fit.reliability = 0.2;
    RecordingWriter(folder_.Path() / "map.sqmap", {}).Add(map);
    WriteTrajectory(folder_.Path() / "trajectory.txt", KeyframeTrajectory(map));
    WriteObjects(folder_.Path() / "objects.json", map.objects);
    const MapSnapshotPtr recorded = RecordingReader(folder_.Path() / "map.sqmap").Last();
    WritePoints(folder_.Path() / "points.ply", recorded->points, FrameOf(*recorded));
  }
  std::string Map() const { return folder_.Path().string(); }
  double CupHeight() const {
    return 2.0 * ReadObjects(folder_.Path() / "objects.json")[1].superquadric.shape.half_size.z();
  }
  double WayOf(const fs::path& file) const {
    const Trajectory path = ReadTrajectory(file);
    return (path.back().T_map_camera.translation - path.front().T_map_camera.translation).norm();
  }
  void ExpectRefused(const std::string& arguments, int exit_code, const std::string& message) const {
    const std::string before = Slurp(folder_.Path() / "map.sqmap");
    const ProgramRun run = RunProgram("scale " + Map() + " " + arguments);
    EXPECT_EQ(run.exit_code, exit_code) << run.err;
    EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr(message)));
    EXPECT_EQ(Slurp(folder_.Path() / "map.sqmap"), before);
  }
  TemporaryFolder folder_;
};

TEST_F(ScaleCommand, BringsAllFilesToMetresAndBack) {
  const std::string points = Slurp(folder_.Path() / "points.ply");
  const double way = WayOf(folder_.Path() / "trajectory.txt");
  const ProgramRun first = RunProgram("scale " + Map() + " --object 1 --height 0.1");
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.out, HasSubstr("1 map unit is 0.25 m, give or take 0.001"));
  EXPECT_THAT(first.out, HasSubstr("(0.5 %): by the height of 1 cup, 0.1 m"));
  EXPECT_NEAR(CupHeight(), 0.1, 1e-9);
  EXPECT_NEAR(WayOf(folder_.Path() / "trajectory.txt"), 0.25 * way, 1e-6);
  EXPECT_THAT(Slurp(folder_.Path() / "trajectory.txt"), HasSubstr("; metres, 1 map unit = 0.2"));
  EXPECT_NE(Slurp(folder_.Path() / "points.ply"), points);
  // A second call is about the map's units again, not about what the first made of them.
  ASSERT_EQ(RunProgram("scale " + Map() + " --object cup --height 0.2").exit_code, 0);
  EXPECT_NEAR(CupHeight(), 0.2, 1e-9);
  EXPECT_NEAR(WayOf(folder_.Path() / "trajectory.txt"), 0.5 * way, 1e-6);
  EXPECT_THAT(RunProgram("scale " + Map()).out, HasSubstr("1 map unit is 0.5 m"));
  EXPECT_THAT(RunProgram("info " + Map()).out, HasSubstr("lengths    metres: 1 map unit is 0.5 m"));
  ASSERT_EQ(RunProgram("scale " + Map() + " --none").exit_code, 0);
  EXPECT_NEAR(CupHeight(), 0.4, 1e-9);
  EXPECT_EQ(Slurp(folder_.Path() / "points.ply"), points);
  EXPECT_THAT(RunProgram("scale " + Map()).out, HasSubstr("no scale"));
}

TEST_F(ScaleCommand, CompletesInterruptedCallWhenRepeated) {
  const fs::path trajectory = folder_.Path() / "trajectory.txt";
  const fs::path keyframes = folder_.Path() / "keyframes.txt";
  const double way = WayOf(trajectory);
  fs::copy_file(trajectory, keyframes);
  StoreMapScale(folder_.Path() / "map.sqmap", MapScale{5.0, 0.1, "a call that was killed"});
  WriteTrajectory(trajectory, ReadTrajectory(trajectory), 1.0);
  for (int call = 0; call < 2; ++call) {
    ASSERT_EQ(RunProgram("scale " + Map() + " --object 1 --height 0.1").exit_code, 0);
    EXPECT_NEAR(WayOf(trajectory), 0.25 * way, 1e-6);
    EXPECT_NEAR(WayOf(keyframes), 0.25 * way, 1e-6);
    EXPECT_NEAR(CupHeight(), 0.1, 1e-9);
    fs::copy_file(trajectory, keyframes, fs::copy_options::overwrite_existing);
  }
}

TEST_F(ScaleCommand, ScalesAllFilesButBrokenOnes) {
  const fs::path keyframes = folder_.Path() / "keyframes.txt";
  folder_.Write("keyframes.txt", "x\n");
  const ProgramRun run = RunProgram("scale " + Map() + " --object 1 --height 0.1");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr("keyframes.txt:")));
  EXPECT_NEAR(CupHeight(), 0.1, 1e-9);
  EXPECT_EQ(Slurp(keyframes), "x\n");
}

TEST_F(ScaleCommand, NoneRemovesBrokenScale) {
  const fs::path recording = folder_.Path() / "map.sqmap";
  sqlite::Execute(
      sqlite::Open(recording, SQLITE_OPEN_READWRITE).get(), recording,
      R"(INSERT INTO meta VALUES ('map_scale', '{"metres": null, "deviation": 1, "source": "x"}'))");
  EXPECT_THAT(RunProgram("info " + Map()).err, HasSubstr("sqslam scale --none removes it"));
  const ProgramRun run = RunProgram("scale " + Map() + " --none");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(RunProgram("info " + Map()).exit_code, 0);
  EXPECT_NEAR(CupHeight(), 0.4, 1e-9);
}

TEST_F(ScaleCommand, AcceptsDistanceOfObjects) {
  ASSERT_EQ(RunProgram("scale " + Map() + " --distance 0 1 2").exit_code, 0);
  const std::vector<SnapshotObject> objects = ReadObjects(folder_.Path() / "objects.json");
  EXPECT_NEAR(
      (objects[0].superquadric.T_map_object.translation - objects[1].superquadric.T_map_object.translation)
          .norm(),
      2.0, 1e-9);
}

TEST_F(ScaleCommand, ExportsMetres) {
  ASSERT_EQ(RunProgram("scale " + Map() + " --object 1 --height 4").exit_code, 0);
  const std::string file = Map() + "/exported.json";
  ASSERT_EQ(RunProgram("export " + Map() + " -o " + file).exit_code, 0);
  EXPECT_NEAR(ReadObjects(file)[1].superquadric.shape.half_size.z(), 2.0, 1e-9);
  const RecordingReader reader(folder_.Path() / "map.sqmap");
  const app::MapView page =
      app::ReadMapView(reader, app::ReadHistory(reader), folder_.Path() / "map.sqmap", {});
  EXPECT_THAT(page.scene, HasSubstr("\"metres\":1.0"));
}

// A scale of 1 changes nothing but the unit beside the axes.
TEST_F(ScaleCommand, LabelsPicturesInMetres) {
  const auto picture = [&] {
    const std::string file = Map() + "/picture.png";
    EXPECT_EQ(RunProgram("render " + Map() + " --resolution 480,320 --output " + file).exit_code, 0);
    return cv::imread(file);
  };
  const cv::Mat units = picture();
  ASSERT_EQ(RunProgram("scale " + Map() + " --object 1 --height 0.4").exit_code, 0);
  const cv::Mat metres = picture();
  ASSERT_EQ(units.size(), metres.size());
  EXPECT_GT(cv::norm(units, metres, cv::NORM_INF), 50.0);
  const cv::Rect most(0, 0, 480, 260);
  EXPECT_EQ(cv::norm(units(most), metres(most), cv::NORM_INF), 0.0);
}

TEST_F(ScaleCommand, WarnsOfUncertainObjects) {
  const ProgramRun run = RunProgram("scale " + Map() + " --object 2 --height 0.3");
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.err, HasSubstr("warning: 2 sports_ball is uncertain (reliability 0.20)"));
}

TEST_F(ScaleCommand, RefusesWrongUseInOneLine) {
  ExpectRefused("--object 7 --height 1", 3,
                "the map has no object 7, expected one of 0 book, 1 cup, 2 sports_ball");
  ExpectRefused("--object 1 --height 0", 2, "0 m: expected a length above 0");
  ExpectRefused("--object 1 --height -2", 2, "-2 m: expected a length above 0");
  ExpectRefused("--object 1 --height 1e308", 3, "a map unit would be inf m, give or take");
  ExpectRefused("--object 1", 2, "--object: expected --height METRES with it");
  ExpectRefused("--distance 0 1", 2, "--distance: expected A B METRES");
  ExpectRefused("--distance 0 1 -3", 2, "-3 m: expected a length above 0");
  ExpectRefused("--distance 0 1 3 --none", 2, "expected one of --object");
  ExpectRefused("--board", 3, "the mapped images are needed to find a board");
  ExpectRefused("--board --marker-mm 30", 2, "marker");
  EXPECT_EQ(RunProgram("run " + Map() + " --scale-from cup").exit_code, 2);
}

// A real map: localize, extend and the folders for other programs see metres, and the map itself stays.
TEST(ScaledMap, KeepsMetresInLaterCommands) {
  const WrittenSequence sequence(HandHeldPath(90));
  const TemporaryFolder folder;
  const auto out = [&](const std::string& name) { return (folder.Path() / name).string(); };
  const auto run = [&](const std::string& arguments) {
    const ProgramRun result = RunProgram(arguments);
    ASSERT_EQ(result.exit_code, 0) << arguments << "\n" << result.err;
  };
  run("run " + sequence.Path().string() + " --no-render --deterministic --detector none --frames 60 -o " +
      out("map"));
  run("localize " + sequence.Path().string() + " --map " + out("map") + " --frames 50 -o " + out("plain"));
  StoreMapScale(folder.Path() / "map/map.sqmap", MapScale{10.0, 0.1, "a test"});
  run("localize " + sequence.Path().string() + " --map " + out("map") + " --frames 50 -o " + out("scaled"));
  run("run " + sequence.Path().string() +
      " --no-render --deterministic --detector none --frames 60: --extend " + out("map") + " -o " +
      out("longer"));
  run("export " + out("map") + " --format nerfstudio -o " + out("nerf"));

  const Trajectory plain = ReadTrajectory(folder.Path() / "plain/trajectory.txt");
  const Trajectory scaled = ReadTrajectory(folder.Path() / "scaled/trajectory.txt");
  ASSERT_EQ(plain.size(), scaled.size());
  EXPECT_LT((10.0 * plain.back().T_map_camera.translation - scaled.back().T_map_camera.translation).norm(),
            1e-6);
  const RecordingReader found(folder.Path() / "scaled/map.sqmap");
  EXPECT_LT((found.Last()->keyframes.back().T_map_camera.translation - scaled.back().T_map_camera.translation)
                .norm(),
            1e-6);
  const RecordingReader longer(folder.Path() / "longer/map.sqmap");
  ASSERT_TRUE(longer.Info().scale);
  EXPECT_EQ(longer.Info().scale->metres, 10.0);
  const Trajectory keyframes = ReadTrajectory(folder.Path() / "longer/keyframes.txt");
  EXPECT_LT(
      (longer.Last()->keyframes.front().T_map_camera.translation - keyframes.front().T_map_camera.translation)
          .norm(),
      1e-4);
  EXPECT_GT((keyframes.back().T_map_camera.translation - keyframes.front().T_map_camera.translation).norm(),
            5.0 * (plain.back().T_map_camera.translation - plain.front().T_map_camera.translation).norm());
  EXPECT_TRUE(fs::exists(folder.Path() / "nerf/transforms.json"));
}

}  // namespace
}  // namespace sqslam::testing
