#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/experiment/tables.h"
#include "tests/app/run_program.h"

namespace sqslam::app {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A run of the sequence `desk` with a box and a cup; an IoU below 0 is a missed one.
CellResult MadeRun(int repetition, double box_iou, double cup_iou) {
  CellResult result;
  result.cell = {"", "desk", "superquadric", "full", "refined", "", kAllObjects, repetition};
  result.has_objects = true;
  result.objects = {{1, "big box", "box", true, box_iou >= 0, std::max(0.0, box_iou)},
                    {2, "cup", "cup", true, cup_iou >= 0, std::max(0.0, cup_iou)}};
  result.mapped = 2;
  return result;
}

std::vector<std::string> RowOf(const Table& table, const std::string& name, const std::string& figure) {
  for (const auto& row : table.rows) {
    if (row[0].text == name && row[1].text == figure) {
      std::vector<std::string> cells;
      std::transform(row.begin() + 2, row.end(), std::back_inserter(cells), FormatCell);
      return cells;
    }
  }
  return {};
}

TEST(SequenceTable, AveragesFoundObjectsAndAllObjects) {
  const Table table = SequenceTable({MadeRun(1, 0.8, 0.6), MadeRun(2, 0.8, -1), MadeRun(3, 0.6, 0.4)});
  EXPECT_THAT(RowOf(table, "desk", "3D IoU of those found"), ElementsAre("0.700 (0.500 to 0.800)"));
  EXPECT_THAT(RowOf(table, "desk", "3D IoU, missed as 0"), ElementsAre("0.500 (0.400 to 0.700)"));
  EXPECT_THAT(RowOf(table, "desk", "found of 2"), ElementsAre("2 (1 to 2)"));
}

TEST(SequenceTable, ComparesRepresentationsAndMethods) {
  CellResult quadric = MadeRun(1, 0.5, 0.5);
  quadric.cell.representation = "quadric";
  CellResult paper = MadeRun(1, 0.3, 0.3);
  paper.cell.method = "paper";
  const Table table = SequenceTable({MadeRun(1, 0.8, 0.8), quadric, paper});
  EXPECT_THAT(table.columns, ElementsAre("sequence", "figure", "superquadric (refined)", "quadric (refined)",
                                         "superquadric (paper)"));
  EXPECT_THAT(RowOf(table, "desk", "3D IoU of those found"), ElementsAre("0.800", "0.500", "0.300"));
  EXPECT_THAT(RowOf(table, "desk", "3D IoU, missed as 0"), IsEmpty());  // nothing is missed
}

TEST(SequenceTable, IgnoresOtherAssociationsAndLimitedBoxes) {
  CellResult iou = MadeRun(1, 0.1, 0.1);
  iou.cell.association = "iou";
  CellResult limited = MadeRun(1, 0.1, 0.1);
  limited.cell.max_objects = 4;
  EXPECT_THAT(RowOf(SequenceTable({MadeRun(1, 0.8, 0.8), iou, limited}), "desk", "3D IoU of those found"),
              ElementsAre("0.800"));
}

TEST(SequenceTable, CountsOnlyScoredObjects) {
  CellResult run = MadeRun(1, 0.8, 0.2);
  run.has_scored = true;
  run.objects[1].scored = false;
  const Table table = SequenceTable({run});
  EXPECT_THAT(RowOf(table, "desk", "3D IoU of those found"), ElementsAre("0.800"));
  EXPECT_THAT(RowOf(table, "desk", "found of 1"), ElementsAre("1"));
}

TEST(RepresentationTable, HasRowsForClassesChosenObjectsAndAll) {
  CellResult other = MadeRun(1, 0.4, 0.2);
  other.cell.sequence = "shelf";
  const Table table = RepresentationTable({MadeRun(1, 0.8, 0.6), other}, {"desk/cup"});
  EXPECT_THAT(RowOf(table, "box", "3D IoU of those found"), ElementsAre("0.600"));
  EXPECT_THAT(RowOf(table, "box", "found of 2"), ElementsAre("2"));
  EXPECT_THAT(RowOf(table, "desk: 2 cup", "3D IoU of those found"), ElementsAre("0.600"));
  EXPECT_THAT(RowOf(table, "all", "3D IoU of those found"), ElementsAre("0.500"));
  EXPECT_THAT(RowOf(table, "all", "with 3D IoU 0.25 or more"), ElementsAre("3"));
  EXPECT_THAT(RowOf(table, "all", "with 3D IoU 0.5 or more"), ElementsAre("2"));
  EXPECT_EQ(table.rows.size(), 16u);
}

TEST(AssociationTable, CountsLandmarksOfEachMode) {
  CellResult iou = MadeRun(1, 0.8, -1);
  iou.cell.association = "iou";
  iou.mapped = 5;
  iou.duplicates = 3;
  iou.extra = 1;
  iou.total_60 = 2;
  iou.found_60 = 1;
  const Table table = AssociationTable({MadeRun(1, 0.8, 0.8), MadeRun(2, 0.8, -1), iou});
  EXPECT_THAT(RowOf(table, "desk", "full"), ElementsAre("2", "2", "1.5 (1.0 to 2.0)", "1.5 (1.0 to 2.0)",
                                                        "1.5 (1.0 to 2.0)", "0", "0", "2", "0", "0"));
  EXPECT_THAT(RowOf(table, "desk", "iou"), ElementsAre("1", "5", "1", "1", "1", "3", "1", "2", "1", "2"));
}

CellResult Timed(int objects, int repetition, double tracking, double mapping) {
  CellResult result = MadeRun(repetition, 0.5, 0.5);
  result.cell.max_objects = objects;
  result.stats.objects = objects;
  result.stats.timing_ms["tracking"].mean = tracking;
  result.stats.timing_ms["mapping"].mean = mapping;
  return result;
}

TEST(RuntimeTable, SubtractsRowWithFewestObjects) {
  const Table table =
      RuntimeTable({Timed(12, 1, 30, 236), Timed(0, 1, 20, 210), Timed(0, 2, 22, 214), Timed(4, 1, 25, 220)});
  std::vector<std::string> lines;
  for (const auto& row : table.rows) {
    lines.push_back(row[2].text + ": " + FormatCell(row[4]) + " +" + FormatCell(row[5]) + "; " +
                    FormatCell(row[8]) + " +" + FormatCell(row[9]) + "; " + FormatCell(row[6]));
  }
  EXPECT_THAT(lines, ElementsAre("0: 21.0 (20.0 to 22.0) +-; 212.0 (210.0 to 214.0) +-; -",
                                 "4: 25.0 +4.0; 220.0 +8.0; -", "12: 30.0 +9.0; 236.0 +24.0; -"));
}

TEST(RuntimeTable, NotesParallelRuns) {
  CellResult run = Timed(0, 1, 20, 210);
  EXPECT_EQ(RuntimeTable({run}).notes.size(), 1u);
  run.jobs = 4;
  EXPECT_THAT(RuntimeTable({run}).notes.back(), HasSubstr("4 runs at a time"));
}

TEST(WriteTables, ListsMissingAndFailedRuns) {
  const TemporaryFolder folder;
  ExperimentOutcome outcome;
  outcome.cells = 3;
  outcome.results = {MadeRun(1, 0.8, 0.6), MadeRun(2, 0.8, 0.6)};
  outcome.results[1].program = "another";
  outcome.failures = {{"desk-x|y", 4, "no map"}};
  const std::string text = testing::Slurp(WriteTables({}, outcome, folder.Path()));
  EXPECT_THAT(text, AllOf(HasSubstr("2 of 3 runs"), HasSubstr("2 different builds"),
                          HasSubstr("| desk-x\\|y | 4 | no map |"), HasSubstr("## Table I:"),
                          HasSubstr("## Table IV:")));
  for (int i = 1; i <= 4; ++i) {
    for (const char* extension : {".md", ".tex", ".csv"}) {
      EXPECT_TRUE(std::filesystem::exists(folder.Path() / ("table-" + std::to_string(i) + extension)));
    }
  }
}

}  // namespace
}  // namespace sqslam::app
