#include "slam/evaluation/comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using Eigen::Vector3d;
using testing::ElementsAre;
using testing::HasSubstr;

Trajectory StraightPath() {
  Trajectory trajectory;
  for (int i = 0; i < 20; ++i) {
    const double t = 0.1 * i;
    trajectory.push_back({t, {Eigen::Quaterniond::Identity(), {std::cos(t), std::sin(2 * t), 0.3 * t}}});
  }
  return trajectory;
}

// A cube at the origin, a magazine of 4 mm at x = 1 and a cube at x = 2.
GroundTruth ComparedTruth() {
  GroundTruth truth;
  truth.trajectory = StraightPath();
  truth.frames = 20;
  truth.has_objects = true;
  for (int i = 0; i < 3; ++i) {
    GroundTruthObject object;
    object.id = i + 1;
    object.label = i == 1 ? "book" : "box";
    object.solid.half_size = i == 1 ? Vector3d(0.1, 0.1, 0.002) : Vector3d(0.1, 0.1, 0.1);
    object.solid.T_map_object.translation = {1.0 * i, 0, 0};
    truth.objects.push_back(object);
  }
  return truth;
}

SnapshotObject MappedBox(int id, const Vector3d& center, const Vector3d& half_size) {
  SnapshotObject object;
  object.id = id;
  object.label = "box";
  object.observations = 33;
  object.superquadric = {{half_size, 0.1, 0.1}, {Eigen::Quaterniond::Identity(), center}};
  return object;
}

// Both find the first cube and the magazine (5 mm too high); the second also finds the last cube, and maps
// something far away.
std::vector<NamedEvaluation> TwoResults() {
  const Vector3d cube(0.1, 0.1, 0.1);
  const std::vector<SnapshotObject> two = {MappedBox(1, {0, 0, 0}, cube),
                                           MappedBox(2, {1, 0, 0.005}, {0.1, 0.1, 0.002})};
  std::vector<SnapshotObject> more = two;
  more.push_back(MappedBox(3, {2, 0, 0}, cube));
  more.push_back(MappedBox(9, {2, 3, 4}, {0.2, 0.3, 0.4}));
  return {{"a", Evaluate(StraightPath(), two, ComparedTruth(), {})},
          {"b", Evaluate(StraightPath(), more, ComparedTruth(), {})}};
}

const Table& Titled(const std::vector<Table>& tables, const std::string& title) {
  const auto it = std::find_if(tables.begin(), tables.end(), [&](const auto& t) { return t.title == title; });
  EXPECT_NE(it, tables.end()) << title;
  return it == tables.end() ? tables.front() : *it;
}

std::vector<std::string> RowOf(const Table& table, const std::string& name) {
  for (const auto& row : table.rows) {
    if (row.front().text == name) {
      std::vector<std::string> cells;
      std::transform(row.begin() + 1, row.end(), std::back_inserter(cells), FormatCell);
      return cells;
    }
  }
  return {"no row " + name};
}

TEST(CompareEvaluations, ListsMissedObjectsAsZeroInSecondMean) {
  const auto results = TwoResults();
  const auto tables = CompareEvaluations(results);
  EXPECT_THAT(RowOf(Titled(tables, "3D IoU"), "3 box"), ElementsAre("missed", testing::StartsWith("0.9")));
  const Table& summary = Titled(tables, "Results side by side");
  EXPECT_THAT(RowOf(summary, "objects found"), ElementsAre("2 of 3", "3 of 3"));
  EXPECT_THAT(RowOf(summary, "extra"), ElementsAre("0", "1"));
  const Evaluation& a = results[0].evaluation;
  EXPECT_NEAR(a.iou.mean_all, a.iou.mean * 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(results[1].evaluation.iou.mean_all, results[1].evaluation.iou.mean, 1e-12);
}

TEST(CompareEvaluations, ReportsFootprintOfThinObjects) {
  const auto results = TwoResults();
  const Table table = Titled(CompareEvaluations(results), "Footprint IoU of thin objects");
  EXPECT_EQ(table.rows.size(), 3u);  // the magazine, mean, found
  EXPECT_GT(results[0].evaluation.objects.matches[1].footprint_iou, 0.98);
  EXPECT_LT(results[0].evaluation.objects.matches[1].iou, 0.01);
  EXPECT_THAT(RowOf(table, "found"), ElementsAre("1 of 1", "1 of 1"));
}

TEST(CompareEvaluations, DescribesEveryExtraLandmark) {
  const auto results = TwoResults();
  ASSERT_EQ(results[1].evaluation.extra.size(), 1u);
  const ExtraLandmark& extra = results[1].evaluation.extra[0];
  EXPECT_EQ(extra.nearest, 2);
  EXPECT_NEAR(extra.distance, 5.0, 1e-6);
  EXPECT_EQ(extra.iou, 0.0);
  const Table table = Titled(CompareEvaluations(results), "Landmarks that match no ground-truth object");
  EXPECT_THAT(RowOf(table, "b"), ElementsAre("9 box", "33", "2.00 3.00 4.00", "0.200 0.300 0.400", "3 box",
                                             "5.00", "0.000", "0"));
}

TEST(CompareEvaluations, RejectsResultsOfDifferentSequences) {
  auto results = TwoResults();
  results[1].evaluation.frames = 7;
  EXPECT_THROW(CompareEvaluations(results), UsageError);
}

TEST(WriteComparison, ChoosesFormatByExtension) {
  const TemporaryFolder folder;
  const auto written = [&](const std::string& name) {
    WriteComparison(folder.Path() / name, TwoResults());
    std::ifstream file(folder.Path() / name);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  EXPECT_THAT(written("t.md"), HasSubstr("| 3 box | missed |"));
  EXPECT_THAT(written("t.tex"), HasSubstr("\\toprule"));
  EXPECT_THAT(written("t.csv"), HasSubstr("\na,missed,3,box,"));
  const auto json = nlohmann::json::parse(written("t.json"));
  EXPECT_EQ(json["results"][1]["name"], "b");
  EXPECT_EQ(json["results"][1]["summary"]["extra"], 1);
  EXPECT_THROW(WriteComparison(folder.Path() / "t.doc", TwoResults()), UsageError);
}

TEST(ShortNames, ReturnsFolderNamesUnlessEqual) {
  EXPECT_THAT(ShortNames({"out/a", "out/b/"}), ElementsAre("a", "b"));
  EXPECT_THAT(ShortNames({"x/a", "y/a"}), ElementsAre("x/a", "y/a"));
}

}  // namespace
}  // namespace sqslam
