#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "app/experiment/cells.h"
#include "app/experiment/config.h"
#include "slam/io/detections.h"
#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"

namespace sqslam::app {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

std::string UsageErrorOf(const std::string& yaml) {
  try {
    ParseExperiment(yaml, "x/e.yaml");
  } catch (const UsageError& error) {
    return error.what();
  }
  return "(no UsageError)";
}

constexpr const char* kOneSequence = "sequences: [{path: data/kitchen}]\n";

std::vector<std::string> NamesOfCells(const ExperimentConfig& config) {
  std::vector<std::string> names;
  for (const ExperimentCell& cell : ListCells(config)) {
    names.push_back(cell.name);
  }
  return names;
}

TEST(ParseExperiment, DefaultsToOneRunWithProgramDefaults) {
  const ExperimentConfig config = ParseExperiment(kOneSequence, "x/e.yaml");
  EXPECT_EQ(config.output, "out/e");
  EXPECT_EQ(config.jobs, 1);
  EXPECT_THAT(NamesOfCells(config), ElementsAre("kitchen-superquadric-full-refined-1"));
}

TEST(ParseExperiment, ReportsLineAndNearestWord) {
  const std::string one = kOneSequence;
  EXPECT_THAT(UsageErrorOf(one + "repetition: 3\n"),
              AllOf(HasSubstr("x/e.yaml:2:"), HasSubstr("'repetitions'?")));
  EXPECT_THAT(UsageErrorOf("sequences:\n  - path: a\n    detection: b\n"),
              AllOf(HasSubstr("x/e.yaml:3:"), HasSubstr("'detections'?")));
  EXPECT_THAT(UsageErrorOf(one + "repetitions: three\n"), AllOf(HasSubstr(":2:"), HasSubstr("'three'")));
  EXPECT_THAT(UsageErrorOf(one + "slurm:\n  partitio: batch\n"),
              AllOf(HasSubstr(":3:"), HasSubstr("partition'?")));
  EXPECT_THAT(UsageErrorOf(one + "repetitions: 0\n"), HasSubstr("from 1 to"));
  EXPECT_THAT(UsageErrorOf(one + "deterministic: [1]\n"), HasSubstr("true or false"));
  EXPECT_THAT(UsageErrorOf(one + "associations: [full, iou+point]\n"), HasSubstr("'iou+points'?"));
  EXPECT_THAT(UsageErrorOf(one + "representations: [quadrics]\n"), HasSubstr("'quadric'?"));
  EXPECT_THAT(UsageErrorOf(one + "max_objects: [4, -1]\n"), HasSubstr("'-1'"));
  EXPECT_THAT(UsageErrorOf(one + "grids:\n  - {sequences: [kitchn]}\n"),
              AllOf(HasSubstr(":3:"), HasSubstr("'kitchen'?")));
  EXPECT_THAT(UsageErrorOf(one + "variants:\n  - {name: a, set: [objects.yaw.sample=3]}\n"),
              AllOf(HasSubstr(":3:"), HasSubstr("objects.yaw.samples")));
  EXPECT_THAT(UsageErrorOf(one + "jobs: [\n"), HasSubstr("invalid YAML"));
  EXPECT_THAT(UsageErrorOf("jobs: 2\n"), HasSubstr("without 'sequences'"));
  EXPECT_THAT(UsageErrorOf("sequences: [{path: a, scene: b}]\n"), HasSubstr("only one of"));
  EXPECT_THAT(UsageErrorOf("sequences: [{path: a}, {path: b/a}]\n"), HasSubstr("'a' is taken"));
  EXPECT_THAT(UsageErrorOf("sequences: [{path: a, name: ../b}]\n"), HasSubstr("'../b'"));
  EXPECT_THAT(UsageErrorOf("[]"), HasSubstr("expected lines"));
}

TEST(ParseExperiment, AcceptsBundledExperiments) {
  for (const char* name : {"desk", "paper"}) {
    const auto path =
        std::filesystem::path(SQSLAM_SOURCE_DIR) / "configs/experiments" / (std::string(name) + ".yaml");
    EXPECT_GT(ListCells(ReadExperiment(path)).size(), 50u) << name;
  }
}

TEST(ListCells, SharesCellsOfGridsAndOrdersByRepetition) {
  const ExperimentConfig config = ParseExperiment(
      "sequences: [{path: a}, {path: b}]\nrepetitions: 2\nvariants: [{name: v, set: [seed=3]}]\n"
      "grids:\n"
      "  - {representations: [superquadric, quadric], sequences: [a]}\n"
      "  - {associations: [full, iou], sequences: [a], repetitions: 1}\n"
      "  - {max_objects: [0, all], sequences: [b], variants: [default, v], repetitions: 1}\n",
      "e.yaml");
  EXPECT_THAT(
      NamesOfCells(config),
      ElementsAre("a-superquadric-full-refined-1", "a-quadric-full-refined-1", "a-superquadric-iou-refined-1",
                  "b-superquadric-full-refined-objects0-1", "b-superquadric-full-refined-1",
                  "b-superquadric-full-refined-v-objects0-1", "b-superquadric-full-refined-v-1",
                  "a-superquadric-full-refined-2", "a-quadric-full-refined-2"));
}

TEST(LimitBoxes, KeepsObjectsWithMostBoxes) {
  const TemporaryFolder folder;
  const auto boxes = folder.Write("boxes.txt",
                                  "0.0 cup 1 0 0 5 5 7\n0.0 cup 1 9 0 5 5 3\n1.0 cup 1 9 0 5 5 3\n"
                                  "1.0 tv 1 0 0 5 5 9\n1.0 cat 1 0 0 5 5 -1\n2.0 cat 1 0 0 5 5 -1\n");
  const std::string one = LimitBoxes(boxes, 1);
  EXPECT_THAT(one, AllOf(HasSubstr("0.0 cup 1 9 0 5 5 3\n1.0 cup 1 9 0 5 5 3\n"), Not(HasSubstr(" 7\n")),
                         Not(HasSubstr("cat"))));
  EXPECT_THAT(LimitBoxes(boxes, 0), Not(HasSubstr("\n0")));
  EXPECT_THAT(LimitBoxes(boxes, 9), AllOf(HasSubstr(" 7\n"), HasSubstr(" 9\n"), Not(HasSubstr("cat"))));
}

TEST(LimitBoxes, CountsByLabelWithoutIds) {
  const TemporaryFolder folder;
  const auto boxes = folder.Write("boxes.txt", "0 tv 1 0 0 5 5\n0 cup 1 0 0 5 5\n1 cup 1 0 0 5 5\n");
  EXPECT_THAT(LimitBoxes(boxes, 1), AllOf(HasSubstr("1 cup"), Not(HasSubstr("tv"))));
}

// The inputs of a sequence, described by YAML with paths in a folder.
class Inputs : public ::testing::Test {
 protected:
  PreparedSequence Prepared(const std::string& sequence) const {
    const std::string file = (folder_.Path() / "e.yaml").string();
    const ExperimentConfig config = ParseExperiment("sequences: [{" + sequence + "}]\n", file);
    return Prepare(config, config.sequences.front(), {folder_.Path() / "out"});
  }
  void ExpectChange(const std::string& sequence, const std::string& file) const {
    folder_.Write(file, "before");
    const std::string before = Prepared(sequence).inputs;
    EXPECT_EQ(Prepared(sequence).inputs, before) << sequence;
    folder_.Write(file, "and after");
    EXPECT_NE(Prepared(sequence).inputs, before) << sequence << ", " << file;
  }

  TemporaryFolder folder_;
};

TEST_F(Inputs, ChangeWithImagesVideosCamerasAndBoxes) {
  folder_.Write("kitchen/rgb.txt", "0 rgb/a.png\n");
  folder_.Write("desk.yaml", "name: desk\n");
  ExpectChange("path: kitchen", "kitchen/rgb/a.png");
  ExpectChange("path: images", "images/7.png");
  ExpectChange("path: film.mp4", "film.mp4");
  for (const std::string sequence : {"path: kitchen", "path: film.mp4", "scene: desk.yaml"}) {
    ExpectChange(sequence + ", camera: lens.yaml", "lens.yaml");
    ExpectChange(sequence + ", detections: " + (folder_.Path() / "labels").string(), "labels/a.txt");
  }
  const std::string before = Prepared("path: kitchen").inputs;
  std::filesystem::last_write_time(folder_.Path() / "kitchen/rgb/a.png", {});
  EXPECT_NE(Prepared("path: kitchen").inputs, before) << "another image of the same size";
}

TEST_F(Inputs, IgnoreRenderedScenesAndResultsBesideImages) {
  folder_.Write("desk.yaml", "name: desk\n");
  const PreparedSequence before = Prepared("scene: desk.yaml, detections: other.txt");
  std::filesystem::create_directories(before.path);
  std::ofstream(before.path / "rgb.txt") << "0 a.png\n";
  std::ofstream(before.path / "other.txt") << "0 cup 1 0 0 5 5\n";
  EXPECT_EQ(Prepared("scene: desk.yaml, detections: other.txt").inputs, before.inputs);
  folder_.Write("kitchen/a.png", "image");
  const std::string inputs = Prepared("path: kitchen").inputs;
  folder_.Write("kitchen/out/map.png", "result");
  EXPECT_EQ(Prepared("path: kitchen").inputs, inputs);
}

// A sequence folder, an experiment on it, and a finished cell made by hand.
class FinishedCell : public ::testing::Test {
 protected:
  FinishedCell() {
    folder_.Write("kitchen/boxes.txt", "0 cup 1 0 0 5 5\n");
    const auto run = Run();
    std::filesystem::create_directories(run);
    WriteStats(run / "stats.json", {});
    folder_.Write("e/runs/" + Cell().name + "/eval.json",
                  R"({"summary": {"mapped": 3, "duplicates": 0, "extra": 1,
                       "coverage": [{"min_detections": 60, "mapped": 1, "total": 2}]},
                      "objects": {"matched": [{"ground_truth": 5, "name": "red cup", "label": "cup", "scored": true, "iou": 0.5, "iou_ellipsoid": 0.4}],
                                  "missed": [{"ground_truth": 2, "name": "tv", "label": "tv", "scored": true}]}})");
    WriteCellRecord(run, Settings(), 1, "build");
  }

  std::string Yaml() const {
    return "sequences: [{path: " + (folder_.Path() / "kitchen").string() + "}]\n" + extra_;
  }
  ExperimentConfig Config() const { return ParseExperiment(Yaml(), "e.yaml"); }
  ExperimentFolder Folder() const { return {folder_.Path() / "e"}; }
  ExperimentCell Cell() const { return ListCells(Config()).front(); }
  std::filesystem::path Run() const { return Folder().Run(Cell()); }
  nlohmann::ordered_json Settings(const ExperimentFolder& folder) const {
    const ExperimentConfig config = Config();
    const PreparedSequence prepared = Prepare(config, config.sequences.front(), folder);
    return SettingsOf(config, prepared, CommandsOf(config, prepared, Cell(), folder), folder);
  }
  nlohmann::ordered_json Settings() const { return Settings(Folder()); }
  std::optional<CellResult> Read() const { return ReadCellResult(Run(), Cell(), Settings()); }

  TemporaryFolder folder_;
  std::string extra_;
};

TEST_F(FinishedCell, ReadsBackValuesForTables) {
  const auto result = Read();
  ASSERT_TRUE(result);
  EXPECT_EQ(result->mapped, 3);
  EXPECT_EQ(result->total_60, 2);
  ASSERT_EQ(result->objects.size(), 2u);
  EXPECT_EQ(result->objects[0].name, "tv");  // by id
  EXPECT_FALSE(result->objects[0].found);
  EXPECT_DOUBLE_EQ(result->objects[1].iou, 0.5);
}

TEST_F(FinishedCell, RemainsFinishedWhenFolderMoves) { EXPECT_EQ(Settings(), Settings({"/somewhere/else"})); }

TEST_F(FinishedCell, RerunsWhenSettingsChange) {
  extra_ = "seed: 4\n";
  EXPECT_FALSE(Read());
}

TEST_F(FinishedCell, RerunsWhenInputsChange) {
  folder_.Write("kitchen/boxes.txt", "0 cup 1 0 0 5 6\n");
  EXPECT_FALSE(Read());
}

TEST_F(FinishedCell, RemainsFinishedWhenOtherCellsChange) {
  extra_ = "repetitions: 7\njobs: 3\nassociations: [full, iou]\n";
  EXPECT_TRUE(Read());
}

TEST_F(FinishedCell, RerunsWhenFileIsMissingOrBroken) {
  for (const char* name : {"cell.json", "stats.json", "eval.json"}) {
    const auto path = Run() / name;
    const auto kept = folder_.Path() / "kept";
    std::filesystem::rename(path, kept);
    EXPECT_FALSE(Read()) << name << " missing";
    folder_.Write(std::filesystem::relative(path, folder_.Path()).string(), "{\"half");
    EXPECT_FALSE(Read()) << name << " broken";
    std::filesystem::rename(kept, path);
    EXPECT_TRUE(Read());
  }
}

}  // namespace
}  // namespace sqslam::app
