#include "slam/estimation/two_view.h"

#include <gtest/gtest.h>

#include <random>

#include "slam/geometry/lie.h"

namespace sqslam {
namespace {

class TwoViewTest : public ::testing::Test {
 protected:
  std::vector<TwoViewMatch> Project(const std::vector<Eigen::Vector3d>& points, const Rigid3d& T_2_1) {
    std::vector<TwoViewMatch> matches;
    for (const Eigen::Vector3d& p : points) {
      const auto noisy = [&](const Eigen::Vector3d& p_camera) -> Eigen::Vector2d {
        return camera_.Project(p_camera) + 0.3 * Eigen::Vector2d(noise_(random_), noise_(random_));
      };
      matches.push_back({noisy(p), noisy(T_2_1 * p)});
    }
    return matches;
  }

  std::vector<Eigen::Vector3d> Cloud() {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 300; ++i) {
      points.emplace_back(uniform_(random_), uniform_(random_), 3.0 + uniform_(random_));
    }
    return points;
  }

  std::vector<Eigen::Vector3d> Plane() {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 300; ++i) {
      const double x = uniform_(random_);
      const double y = uniform_(random_);
      points.emplace_back(x, y, 3.0 + 0.5 * x + 0.4 * y);
    }
    return points;
  }

  void ExpectMotion(const TwoViewReport& report, const Rigid3d& T_2_1) {
    ASSERT_TRUE(report.geometry.has_value()) << report.refusal;
    const Rigid3d& found = report.geometry->T_camera2_camera1;
    EXPECT_LT(found.rotation.angularDistance(T_2_1.rotation), 0.02);
    EXPECT_GT(found.translation.normalized().dot(T_2_1.translation.normalized()), 0.99);
  }

  Camera camera_{640, 480, 500.0, 500.0, 320.0, 240.0, {}, 30.0};
  std::mt19937 random_{4};
  std::uniform_real_distribution<double> uniform_{-1.0, 1.0};
  std::normal_distribution<double> noise_{0.0, 1.0};
  Rigid3d T_2_1_{Eigen::Quaterniond(Eigen::AngleAxisd(0.08, Eigen::Vector3d::UnitY())), {-0.4, 0.05, 0.1}};
};

TEST_F(TwoViewTest, FindsMotionForDeepScene) {
  const TwoViewReport report = EstimateTwoView(camera_, Project(Cloud(), T_2_1_), {});
  ExpectMotion(report, T_2_1_);
}

TEST_F(TwoViewTest, FindsMotionOrAmbiguityForPlane) {
  const TwoViewReport report = EstimateTwoView(camera_, Project(Plane(), T_2_1_), {});
  if (report.geometry) {
    ExpectMotion(report, T_2_1_);
  } else {
    EXPECT_NE(report.refusal.find("ambiguous"), std::string::npos) << report.refusal;
  }
}

// A homography explains most of the matches, and gives two motions. The wrong one turns the camera more, so
// that its points have more parallax: only the matches off the plane tell.
TEST_F(TwoViewTest, TellsMotionsOfNearlyPlanarScene) {
  int found = 0;
  for (int scene = 0; scene < 60; ++scene) {
    std::vector<Eigen::Vector3d> points = Plane();
    for (std::size_t i = 0; i < points.size() / 4; ++i) {
      points[i] *= 1.0 + 0.3 * uniform_(random_);
    }
    const Rigid3d T_2_1{
        ExpRotation(0.03 * Eigen::Vector3d(uniform_(random_), uniform_(random_), uniform_(random_))),
        0.15 * Eigen::Vector3d(uniform_(random_), uniform_(random_), uniform_(random_))};
    const TwoViewReport report = EstimateTwoView(camera_, Project(points, T_2_1), {});
    if (report.geometry) {
      ++found;
      EXPECT_GT(report.geometry->T_camera2_camera1.translation.dot(T_2_1.translation.normalized()), 0.8)
          << scene;
    }
  }
  EXPECT_GE(found, 20);
}

TEST_F(TwoViewTest, EpipolarSupportHoldsRightMatchesAndTheirLines) {
  std::vector<TwoViewMatch> matches = Project(Cloud(), T_2_1_);
  const std::size_t wrong = matches.size() / 3;
  for (std::size_t i = 0; i < wrong; ++i) {
    matches[i].pixel2 += Eigen::Vector2d(80.0 * uniform_(random_), 80.0 * uniform_(random_));
  }
  const EpipolarSupport support = FindEpipolarSupport(camera_, matches);
  EXPECT_FALSE(support.only_turns);
  EXPECT_GT(support.inliers.size(), 0.8 * static_cast<double>(matches.size() - wrong));
  for (const TwoViewMatch& match : Project(Cloud(), T_2_1_)) {  // others than those of the estimate
    const Eigen::Vector3d line = support.F21 * match.pixel1.homogeneous();
    EXPECT_LT(std::abs(line.dot(match.pixel2.homogeneous())) / line.head<2>().norm(), 3.0);
  }
}

TEST_F(TwoViewTest, EpipolarSupportTellsRotation) {
  const Rigid3d rotation{Eigen::Quaterniond(Eigen::AngleAxisd(0.15, Eigen::Vector3d::UnitY())),
                         Eigen::Vector3d::Zero()};
  const EpipolarSupport support = FindEpipolarSupport(camera_, Project(Cloud(), rotation));
  EXPECT_TRUE(support.only_turns);
  EXPECT_TRUE(support.F21.isZero());
}

TEST_F(TwoViewTest, FundamentalSupportCountsMatchesOfDistortedPixels) {
  std::vector<TwoViewMatch> matches = Project(Cloud(), T_2_1_);
  Camera lens = camera_;
  lens.distortion = {-0.1, 0.02, 0.0, 0.0, 0.0};
  for (TwoViewMatch& match : matches) {
    match = {lens.ProjectDistorted(camera_.Unproject(match.pixel1)),
             lens.ProjectDistorted(camera_.Unproject(match.pixel2))};
  }
  EXPECT_GT(FundamentalSupport(matches), matches.size() / 2);
  matches.resize(100);
  for (TwoViewMatch& match : matches) {
    match.pixel2 = {320.0 + 320.0 * uniform_(random_), 240.0 + 240.0 * uniform_(random_)};
  }
  EXPECT_LT(FundamentalSupport(matches), 20);
}

TEST_F(TwoViewTest, ToleratesWrongMatches) {
  std::vector<TwoViewMatch> matches = Project(Cloud(), T_2_1_);
  for (std::size_t i = 0; i < matches.size() / 5; ++i) {
    matches[i].pixel2 += Eigen::Vector2d(80.0 * uniform_(random_), 80.0 * uniform_(random_));
  }
  ExpectMotion(EstimateTwoView(camera_, matches, {}), T_2_1_);
}

TEST_F(TwoViewTest, RefusesPureRotation) {
  const Rigid3d rotation{Eigen::Quaterniond(Eigen::AngleAxisd(0.15, Eigen::Vector3d::UnitY())),
                         {0.0, 0.0, 0.0}};
  const TwoViewReport report = EstimateTwoView(camera_, Project(Cloud(), rotation), {});
  EXPECT_FALSE(report.geometry.has_value());
  EXPECT_FALSE(report.refusal.empty());
}

TEST_F(TwoViewTest, FlowWithoutRotationMeasuresTranslationOnly) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.15, Eigen::Vector3d(0.2, 1.0, 0.1).normalized()));
  EXPECT_LT(FlowWithoutRotation(camera_, Project(Cloud(), {turn, {0.0, 0.0, 0.0}})), 0.7);
  EXPECT_GT(FlowWithoutRotation(camera_, Project(Cloud(), {turn, {0.2, 0.0, 0.0}})), 3.0);
}

TEST_F(TwoViewTest, RefusesTooFewMatches) {
  std::vector<TwoViewMatch> matches = Project(Cloud(), T_2_1_);
  matches.resize(12);
  EXPECT_FALSE(EstimateTwoView(camera_, matches, {}).geometry.has_value());
}

}  // namespace
}  // namespace sqslam
