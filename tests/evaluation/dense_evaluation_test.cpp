#include "slam/evaluation/dense_evaluation.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

constexpr double kMapScale = 0.5;  // map units in a metre

// Points of a plane 2 m by 1 m, 50 mm apart.
std::vector<Vector3d> Plane() {
  std::vector<Vector3d> points;
  for (int i = 0; i < 40; ++i) {
    for (int k = 0; k < 20; ++k) {
      points.emplace_back(0.05 * i, 0.05 * k, 0.7);
    }
  }
  return points;
}

std::vector<Vector3d> Shifted(std::vector<Vector3d> points, const Vector3d& by) {
  for (Vector3d& p : points) {
    p += by;
  }
  return points;
}

// A sequence whose true surface is Plane(), and a result in a map half as large as the world.
class DenseEvaluationTest : public ::testing::Test {
 protected:
  DenseEvaluationTest() {
    Trajectory truth, estimated;
    std::string images;
    for (int i = 0; i < 3; ++i) {
      const Rigid3d T_world_camera{Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0), {0.2 * i, 0.1 * i * i, 1.7}};
      truth.push_back({0.1 * i, T_world_camera});
      estimated.push_back({0.1 * i, {T_world_camera.rotation, kMapScale * T_world_camera.translation}});
      images += std::to_string(0.1 * i) + " " + std::to_string(i) + ".jpg\n";
    }
    sequence_.Write("rgb.txt", images);
    WriteTrajectory(sequence_.Path() / "groundtruth.txt", truth);
    WriteTrajectory(result_.Path() / "trajectory.txt", estimated);
    WriteCloud(sequence_, Plane(), 1.0);
  }

  static void WriteCloud(const TemporaryFolder& folder, const std::vector<Vector3d>& points, double scale) {
    std::ofstream file(folder.Path() / "dense.ply");
    file << "ply\nformat ascii 1.0\nelement vertex " << points.size()
         << "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    for (const Vector3d& p : points) {
      file << (scale * p).transpose() << '\n';
    }
  }

  DenseEvaluation Evaluate(const std::vector<Vector3d>& estimate) const {
    WriteCloud(result_, estimate, kMapScale);
    return EvaluateDense(result_.Path(), sequence_.Path());
  }

  TemporaryFolder sequence_, result_;
};

TEST_F(DenseEvaluationTest, MeasuresShiftInMetres) {
  const DenseEvaluation e = Evaluate(Shifted(Plane(), {0.0, 0.0, 0.015}));
  for (const CloudDistances& distances : {e.accuracy, e.completeness}) {
    EXPECT_EQ(distances.points, 800);
    EXPECT_NEAR(distances.median, 0.015, 1e-4);
    EXPECT_NEAR(distances.p90, 0.015, 1e-4);
    EXPECT_EQ(distances.within[0], 0.0);
    EXPECT_EQ(distances.within[1], 1.0);
  }
  EXPECT_THAT(FormatDense(e),
              HasSubstr("median 15.0 mm, p90 15.0 mm, 0.0 % within 10 mm, 100.0 % within 20 mm"));
}

TEST_F(DenseEvaluationTest, MeasuresToPlaneOfNearestPointWithNormals) {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 800\nproperty float x\nproperty float y\n"
      "property float z\nproperty float nx\nproperty float ny\nproperty float nz\nend_header\n";
  for (const Vector3d& p : Plane()) {
    text += fmt::format("{} {} {} 0 0 2\n", p.x(), p.y(), p.z());
  }
  sequence_.Write("dense.ply", text);
  const DenseEvaluation e = Evaluate(Shifted(Plane(), {0.02, 0.02, 0.015}));
  EXPECT_NEAR(e.accuracy.median, 0.015, 1e-4);
  EXPECT_NEAR(e.completeness.median, std::hypot(0.02, 0.02, 0.015), 1e-4);  // counts true points
}

TEST_F(DenseEvaluationTest, MeasuresToPointsWithoutNormal) {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 800\nproperty float x\nproperty float y\n"
      "property float z\nproperty float nx\nproperty float ny\nproperty float nz\nend_header\n";
  for (const Vector3d& p : Plane()) {
    text += fmt::format("{} {} {} 0 0 0\n", p.x(), p.y(), p.z());
  }
  sequence_.Write("dense.ply", text);
  EXPECT_NEAR(Evaluate(Shifted(Plane(), {0.0, 0.0, 0.015})).accuracy.median, 0.015, 1e-4);
}

TEST_F(DenseEvaluationTest, ComparesErrorsWithPredictedSigmas) {
  EXPECT_FALSE(Evaluate(Plane()).normalised_rms);
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 800\nproperty float x\nproperty float y\n"
      "property float z\nproperty float sigma\nend_header\n";
  for (const Vector3d& p : Plane()) {  // 15 mm off, predicted as 10 mm
    text += fmt::format("{} {} {} {}\n", kMapScale * p.x(), kMapScale * p.y(), kMapScale * (p.z() + 0.015),
                        kMapScale * 0.01);
  }
  result_.Write("dense.ply", text);
  const DenseEvaluation e = EvaluateDense(result_.Path(), sequence_.Path());
  ASSERT_TRUE(e.normalised_rms);
  EXPECT_NEAR(*e.normalised_rms, 1.5, 0.01);
  EXPECT_THAT(FormatDense(e), HasSubstr("predicted standard deviations: 1.50"));
}

TEST_F(DenseEvaluationTest, HalfCloudIsHalfComplete) {
  std::vector<Vector3d> half = Plane();
  half.resize(half.size() / 2);
  const DenseEvaluation e = Evaluate(half);
  EXPECT_EQ(e.accuracy.points, 400);
  EXPECT_EQ(e.accuracy.within[0], 1.0);
  EXPECT_EQ(e.completeness.points, 800);
  EXPECT_EQ(e.completeness.within[1], 0.5);
}

TEST_F(DenseEvaluationTest, OutliersLowerAccuracyAlone) {
  std::vector<Vector3d> points = Plane();
  points.resize(900, {5.0, 5.0, 5.0});
  const DenseEvaluation e = Evaluate(points);
  EXPECT_NEAR(e.accuracy.within[1], 800.0 / 900.0, 1e-9);
  EXPECT_GT(e.accuracy.p90, 1.0);
  EXPECT_EQ(e.completeness.within[0], 1.0);
}

TEST_F(DenseEvaluationTest, WritesDistancesToJson) {
  WriteDenseEvaluation(result_.Path() / "dense_eval.json", Evaluate(Plane()));
  std::ifstream file(result_.Path() / "dense_eval.json");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  EXPECT_THAT(text, HasSubstr("\"within_10_mm\": 1.0"));
  EXPECT_THAT(text, HasSubstr("\"completeness\""));
}

TEST_F(DenseEvaluationTest, NamesMissingClouds) {
  EXPECT_THAT(InputErrorOf([&] { EvaluateDense(result_.Path(), sequence_.Path()); }),
              HasSubstr("expected the cloud that sqslam densify writes"));
  std::filesystem::remove(sequence_.Path() / "dense.ply");
  EXPECT_THAT(InputErrorOf([&] { Evaluate(Plane()); }), HasSubstr("expected true surface points"));
}

}  // namespace
}  // namespace sqslam
