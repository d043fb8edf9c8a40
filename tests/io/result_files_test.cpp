#include "slam/io/result_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <tuple>

#include "slam/io/trajectory.h"
#include "slam/util/json_file.h"
#include "slam/util/limits.h"
#include "slam/util/text_lines.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

SnapshotObject Chair() {
  SnapshotObject object;
  object.id = 7;
  object.label = "chair";
  object.score = 0.625;
  object.observations = 42;
  object.points = 130;
  object.yaw = 0.5;
  object.superquadric.shape = {{0.1, 0.2, 0.3}, 0.4, 1.3};
  object.superquadric.T_map_object = {Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ())),
                                      {1.0, -2.0, 0.5}};
  return object;
}

TEST(ResultFiles, StateUnitAndFrame) {
  const TemporaryFolder folder;
  const auto text = [&](const char* name) { return ReadFile(folder.Path() / name, "a result"); };
  for (const auto& [frame, unit, aligned] :
       {std::tuple(MapFrame{}, "map units", false),
        std::tuple(MapFrame{.metric = true, .upright = true}, "metres", true)}) {
    WriteObjects(folder.Path() / "objects.json", {Chair()}, frame);
    const auto json = ReadJsonFile(folder.Path() / "objects.json", "objects");
    EXPECT_EQ(json.at("unit"), unit);
    EXPECT_EQ(json.at("frame"), "map");
    EXPECT_EQ(json.at("gravity_aligned"), aligned);
    EXPECT_THAT(ReadObjects(folder.Path() / "objects.json"), ::testing::SizeIs(1));
    WritePoints(folder.Path() / "points.ply", {}, frame);
    EXPECT_THAT(text("points.ply"),
                ::testing::HasSubstr(aligned ? "comment metres; map frame, z up;"
                                             : "comment map units; map frame, not aligned with gravity;"));
    WriteTrajectory(folder.Path() / "t.txt", {}, aligned ? 2.5 : 1.0, aligned);
    EXPECT_THAT(text("t.txt"),
                ::testing::HasSubstr(aligned ? "; metres, 1 map unit = 2.5 m; map frame, z up"
                                             : "; map units; map frame, not aligned with gravity"));
  }
}

TEST(ObjectsJson, ReadsWhatItWrote) {
  const TemporaryFolder folder;
  WriteObjects(folder.Path() / "objects.json", {Chair(), Chair()});
  const std::vector<SnapshotObject> read = ReadObjects(folder.Path() / "objects.json");
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[1].id, 7);
  EXPECT_EQ(read[1].label, "chair");
  EXPECT_EQ(read[1].score, 0.625);
  EXPECT_EQ(read[1].observations, 42);
  EXPECT_EQ(read[1].points, 130);
  EXPECT_EQ(read[1].yaw, 0.5);
  EXPECT_EQ(read[1].superquadric.shape.half_size, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(read[1].superquadric.shape.e1, 0.4);
  EXPECT_EQ(read[1].superquadric.shape.e2, 1.3);
  EXPECT_TRUE(
      read[1].superquadric.T_map_object.Matrix().isApprox(Chair().superquadric.T_map_object.Matrix(), 1e-12));
}

TEST(ObjectsJson, WritesNamesOnlyWhenSet) {
  const TemporaryFolder folder;
  SnapshotObject named = Chair();
  named.name = "Ada's chair";
  WriteObjects(folder.Path() / "objects.json", {Chair(), named});
  const std::vector<SnapshotObject> read = ReadObjects(folder.Path() / "objects.json");
  EXPECT_EQ(read[0].name, "");
  EXPECT_EQ(read[1].name, "Ada's chair");
}

TEST(ObjectsJson, WritesPartsOnlyWhenKnown) {
  const TemporaryFolder folder;
  const fs::path path = folder.Path() / "objects.json";
  SnapshotObject parted = Chair();
  parted.parts = {{{0.0, -0.5, 0.25}, {{1.0, 0.5, 0.75}, 0.15, 1.0}}};
  WriteObjects(path, {Chair(), parted});
  EXPECT_FALSE(ReadJsonFile(path, "objects").at("objects")[0].contains("parts"));
  const std::vector<SnapshotObject> read = ReadObjects(path);
  EXPECT_TRUE(read[0].parts.empty());
  ASSERT_EQ(read[1].parts.size(), 1u);
  EXPECT_EQ(read[1].parts[0].centre, parted.parts[0].centre);
  EXPECT_EQ(read[1].parts[0].shape.half_size, parted.parts[0].shape.half_size);
  EXPECT_EQ(read[1].parts[0].shape.e2, 1.0);
  parted.parts[0].centre.x() = 0.1;  // reaches out of the hull
  WriteObjects(path, {parted});
  EXPECT_THAT(InputErrorOf([&] { ReadObjects(path); }),
              HasSubstr("object number 0 (from 0): parts: expected"));
}

TEST(ObjectsJson, CutsLongLabelsAndNames) {
  const TemporaryFolder folder;
  SnapshotObject object = Chair();
  object.label = std::string(kMaxLabelBytes + 100, 'a');
  object.name = std::string(kMaxLabelBytes + 100, 'b');
  WriteObjects(folder.Path() / "objects.json", {object});
  const std::vector<SnapshotObject> read = ReadObjects(folder.Path() / "objects.json");
  EXPECT_EQ(read[0].label, std::string(kMaxLabelBytes, 'a'));
  EXPECT_EQ(read[0].name, std::string(kMaxLabelBytes, 'b'));
}

TEST(ObjectsJson, NamesBrokenObject) {
  const TemporaryFolder folder;
  const auto message = [&](const std::string& text) {
    const fs::path path = folder.Write("o.json", text);
    return InputErrorOf([&] { ReadObjects(path); });
  };
  EXPECT_THAT(message("{"), HasSubstr("o.json:1: invalid JSON"));
  EXPECT_THAT(message("[]"), HasSubstr("sqslam-objects"));
  EXPECT_THAT(message(R"({"format": "sqslam-objects", "version": 9, "objects": []})"),
              HasSubstr("version 9"));
  EXPECT_THAT(message(R"({"format": "sqslam-objects", "version": 1, "objects": [{"id": 1}]})"),
              HasSubstr("object number 0"));
}

TEST(PointsPly, HoldsDocumentedColumns) {
  const TemporaryFolder folder;
  WritePoints(folder.Path() / "p.ply",
              {{{1.0F, 2.0F, 3.0F}, {10, 20, 30}, -1}, {{4.0F, 5.0F, 6.0F}, {1, 2, 3}, 9}}, {});
  const std::string bytes = ReadFile(folder.Path() / "p.ply", "");
  EXPECT_THAT(bytes, HasSubstr("element vertex 2\n"));
  const std::size_t data = bytes.find("end_header\n") + 11;
  constexpr std::size_t kRow = 3 * 4 + 3 + 4;
  ASSERT_EQ(bytes.size(), data + 2 * kRow);
  float z = 0.0F;
  std::memcpy(&z, bytes.data() + data + kRow + 8, sizeof(z));
  EXPECT_EQ(z, 6.0F);
  std::int32_t object_id = 0;
  std::memcpy(&object_id, bytes.data() + data + 15, sizeof(object_id));
  EXPECT_EQ(object_id, -1);
}

TEST(StatsJson, ReadsWhatItWrote) {
  const TemporaryFolder folder;
  RunStats stats;
  stats.frames = 10;
  stats.tracked = 9;
  stats.peak_memory_mib = 12.5;
  stats.interrupted = true;
  stats.classes["cup"].boxes = 7;
  stats.classes["cup"].shown = 1;
  stats.classes["cup"][LeftOut::kNoDepth] = 2;
  stats.timing_ms["tracking.features"] = {1.0, 2.0, 3.0, 4.0, 5};
  WriteStats(folder.Path() / "stats.json", stats);
  const RunStats read = ReadStats(folder.Path() / "stats.json");
  EXPECT_EQ(read.frames, 10);
  EXPECT_EQ(read.tracked, 9);
  EXPECT_EQ(read.peak_memory_mib, 12.5);
  EXPECT_TRUE(read.interrupted);
  EXPECT_EQ(read.classes, stats.classes);
  EXPECT_EQ(read.timing_ms.at("tracking.features").p95, 3.0);
  EXPECT_EQ(read.timing_ms.at("tracking.features").count, 5);
}

}  // namespace
}  // namespace sqslam
