#include "slam/evaluation/evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "slam/io/result_files.h"
#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using testing::HasSubstr;

Trajectory Path(int count) {
  Trajectory trajectory;
  for (int i = 0; i < count; ++i) {
    const double t = 0.1 * i;
    trajectory.push_back({t, {Eigen::Quaterniond::Identity(), {std::cos(t), std::sin(2 * t), 0.3 * t}}});
  }
  return trajectory;
}

GroundTruth TwoBoxes() {
  GroundTruth truth;
  truth.trajectory = Path(20);
  truth.frames = 20;
  truth.has_objects = truth.has_detection_counts = truth.has_scored = true;
  truth.objects = {{1, "left", "box", {SolidKind::kCuboid, {0.1, 0.1, 0.1}, 0.1, 0.1, {}}, 70, true},
                   {2, "right", "box", {SolidKind::kCuboid, {0.1, 0.1, 0.1}, 0.1, 0.1, {}}, 25, false}};
  truth.objects[1].solid.T_map_object.translation = {1, 0, 0};
  return truth;
}

SnapshotObject Box(int id, const Vector3d& center) {
  SnapshotObject object;
  object.id = id;
  object.label = "box";
  object.superquadric = {{{0.1, 0.1, 0.1}, 0.1, 0.1}, {Eigen::Quaterniond::Identity(), center}};
  return object;
}

TEST(Evaluate, CountsTrackingCoverageAndScores) {
  Trajectory estimated = Path(15);
  const Evaluation evaluation = Evaluate(estimated, {Box(3, {0, 0, 0})}, TwoBoxes(), {});
  EXPECT_EQ(evaluation.tracked, 15);
  EXPECT_NEAR(evaluation.tracked_share, 0.75, 1e-12);
  EXPECT_NEAR(evaluation.trajectory.rmse, 0.0, 1e-9);
  EXPECT_GT(evaluation.iou.mean, 0.95);
  EXPECT_GT(evaluation.iou.mean, evaluation.iou.mean_ellipsoid);
  EXPECT_EQ(evaluation.scored_iou.objects, 1);
  EXPECT_EQ(evaluation.scored_iou.matched, 1);
  ASSERT_EQ(evaluation.coverage.size(), 2u);
  EXPECT_EQ(evaluation.coverage[0].mapped, 1);  // 20 or more
  EXPECT_EQ(evaluation.coverage[0].total, 2);
  EXPECT_EQ(evaluation.coverage[1].mapped, 1);  // 60 or more
  EXPECT_EQ(evaluation.coverage[1].total, 1);
  const std::string table = FormatEvaluation(evaluation);
  EXPECT_THAT(table, HasSubstr("15 of 20 (75.0 %)"));
  EXPECT_THAT(table, HasSubstr("with 60 or more detections mapped: 1 of 1"));
  EXPECT_THAT(table, HasSubstr("2 right"));
}

TEST(Evaluate, CountsObjectsAboveIou) {
  // The first cube is off by half its size (an IoU of a third), the second exact.
  const Evaluation evaluation = Evaluate(Path(15), {Box(3, {0.1, 0, 0}), Box(4, {1, 0, 0})}, TwoBoxes(), {});
  EXPECT_EQ(evaluation.iou.matched, 2);
  EXPECT_EQ(evaluation.iou.matched_25, 2);
  EXPECT_EQ(evaluation.iou.matched_50, 1);
  EXPECT_EQ(evaluation.scored_iou.matched_50, 0);
  EXPECT_THAT(FormatEvaluation(evaluation), HasSubstr("1.00 at IoU 0.25 (2 of 2), 0.50 at IoU 0.5 (1 of 2)"));
  const auto summary = nlohmann::json::parse(EvaluationJson(evaluation)).at("summary");
  EXPECT_EQ(summary.at("recall_25"), 1.0);
  EXPECT_EQ(summary.at("recall_50"), 0.5);
  EXPECT_EQ(summary.at("recall_50_scored"), 0.0);
}

TEST(Evaluate, RejectsTrajectoryWithoutCommonTimes) {
  Trajectory later = Path(15);
  for (TimedPose& pose : later) {
    pose.timestamp += 1000;
  }
  try {
    Evaluate(later, {}, TwoBoxes(), {}, "out/trajectory.txt");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("out/trajectory.txt"));
    EXPECT_THAT(error.what(), HasSubstr("1000.000"));
  }
}

TEST(Evaluate, RejectsGroundTruthOfShorterSequence) {
  GroundTruth truth = TwoBoxes();
  truth.frames = 12;
  EXPECT_THROW(Evaluate(Path(15), {}, truth, {}), InputError);
}

TEST(Evaluate, WritesValuesOfTableToJson) {
  const TemporaryFolder folder;
  const fs::path path = folder.Path() / "eval.json";
  const Evaluation evaluation =
      Evaluate(Path(20), {Box(3, {0, 0, 0}), Box(4, {0.02, 0, 0}), Box(5, {9, 9, 9})}, TwoBoxes(), {});
  WriteEvaluation(path, evaluation);
  std::ifstream file(path);
  const auto json = nlohmann::json::parse(file);
  EXPECT_EQ(json["summary"]["matched"], 1);
  EXPECT_EQ(json["summary"]["duplicates"], 1);
  EXPECT_EQ(json["summary"]["extra"], 1);
  EXPECT_EQ(json["summary"]["missed"], 1);
  EXPECT_EQ(json["objects"]["matched"][0]["object"], 3);
  EXPECT_EQ(json["objects"]["duplicates"][0]["ground_truth"], 1);
  EXPECT_EQ(json["ground_truth_positions_map"].size(), 20u);
  EXPECT_NEAR(json["trajectory"]["S_world_map"]["scale"].get<double>(), 1.0, 1e-9);
}

// The truth of the desk handed in as if it were a map, in a frame and scale of its own.
TEST(Evaluate, ScoresGroundTruthAsNearlyPerfect) {
  const fs::path sequence = fs::path(SQSLAM_SOURCE_DIR) / "../shared/data/blender_desk_a";
  if (!fs::exists(sequence)) {
    GTEST_SKIP() << "no sequence at " << sequence;
  }
  const GroundTruth truth = ReadGroundTruth(sequence);
  const Sim3d S{3.0, Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Vector3d::UnitZ())), {1, 2, 3}};
  Trajectory trajectory = truth.trajectory;
  for (TimedPose& pose : trajectory) {
    pose.T_map_camera.translation = S * pose.T_map_camera.translation;
  }
  std::vector<SnapshotObject> mapped;
  for (const GroundTruthObject& object : truth.objects) {
    const Solid solid = Transform(S, object.solid);
    SnapshotObject copy = Box(object.id, solid.T_map_object.translation);
    copy.superquadric = {{solid.half_size, solid.e1, solid.e2}, solid.T_map_object};
    mapped.push_back(copy);
  }
  const TemporaryFolder result;
  WriteTrajectory(result.Path() / "trajectory.txt", trajectory);
  WriteObjects(result.Path() / "objects.json", mapped);
  const Evaluation evaluation = EvaluateResult(result.Path(), sequence);
  EXPECT_EQ(evaluation.objects.matches.size(), truth.objects.size());
  for (const ObjectMatch& match : evaluation.objects.matches) {
    EXPECT_EQ(match.mapped, match.truth);
    EXPECT_GT(match.iou, 0.9);
  }
  EXPECT_GT(evaluation.iou.mean, evaluation.iou.mean_ellipsoid + 0.2);
  EXPECT_LT(evaluation.trajectory.rmse, 1e-6);
}

}  // namespace
}  // namespace sqslam
