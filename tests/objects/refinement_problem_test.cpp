#include "slam/objects/refinement_problem.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "slam/geometry/angles.h"
#include "slam/objects/moving_problem.h"

namespace sqslam {
namespace {

// A bit of everything: exact and one-sided edges, points on the surface and outside, contact.
RefinementProblem MakeProblem(bool exact_contact, bool handled) {
  RefinementProblem problem;
  problem.handled = handled;
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto random = [&] { return Eigen::Vector3d(unit(generator), unit(generator), unit(generator)); };
  for (int i = 0; i < 24; ++i) {
    const Eigen::Vector3d camera = 4.0 * random().normalized();
    problem.edges.push_back(
        {random(), camera, -camera.normalized(), 100.0, i % 4, 3.0, i % 3 != 0, i % 5 == 0});
    problem.points.push_back({0.5 * random(), 40.0, 0.7, i % 2 == 0});
  }
  problem.contact = RefinementProblem::Contact{-0.28, 20.0, exact_contact};
  problem.top = RefinementProblem::Contact{0.3, 30.0, true};
  problem.prior = {.log_width_ratio = 0.4,
                   .width_factor = 3.0,
                   .log_height_ratio = -1.5,
                   .height_factor = 2.0,
                   .log_size = -2.0,
                   .size_factor = 4.0,
                   .exponents = {0.3, 0.5},
                   .exponent_factors = {5.0, 6.0},
                   .taper_factor = 2.0,
                   .yaw = 0.2,
                   .yaw_factor = 4.0,
                   .bias_factor = 30.0};
  problem.max_log_half.setConstant(std::log(0.35));  // one half size is beyond
  problem.min_log_half = problem.max_log_half.array() - 6.0;
  return problem;
}

PosedSuperquadric MakeSuperquadric(double e1, double e2) {
  PosedSuperquadric s;
  s.shape = {{0.3, 0.2, 0.4}, e1, e2};
  s.T_map_object = {Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitZ())), {0.05, -0.04, 0.1}};
  return s;
}

TEST(RefinementProblem, MatchesNumericJacobian) {
  for (const bool handled : {false, true}) {
    for (const auto& [e1, e2] :
         {std::pair(0.3, 0.4), std::pair(1.0, 1.0), std::pair(1.6, 0.2), std::pair(0.15, 1.8)}) {
      const bool exact_contact = e1 < 1.0;
      const RefinementProblem problem = MakeProblem(exact_contact, handled);
      const int rows = problem.NumResiduals();
      RefinementProblem::Parameters x = RefinementProblem::Pack(MakeSuperquadric(e1, e2));
      x.tail<6>() << 0.02, -0.01, 0.03, 0.04, -0.3, 0.05;
      Eigen::VectorXd residuals(rows);
      Eigen::MatrixXd jacobian(rows, 15);
      ASSERT_TRUE(problem(x.data(), residuals.data(), jacobian.data()));
      for (int i = 0; i < 15; ++i) {
        constexpr double kStep = 1e-6;
        RefinementProblem::Parameters low = x;
        RefinementProblem::Parameters high = x;
        low[i] -= kStep;
        high[i] += kStep;
        Eigen::VectorXd below(rows);
        Eigen::VectorXd above(rows);
        problem(low.data(), below.data(), nullptr);
        problem(high.data(), above.data(), nullptr);
        const Eigen::VectorXd numeric = (above - below) / (2.0 * kStep);
        for (int row = 0; row < rows; ++row) {
          EXPECT_NEAR(jacobian(row, i), numeric[row], 1e-4 * (1.0 + std::abs(numeric[row])))
              << "residual " << row << " parameter " << i << " e " << e1 << " " << e2;
        }
      }
    }
  }
}

TEST(MovingProblem, MatchesNumericJacobian) {
  const RefinementProblem still = MakeProblem(true, false);
  std::vector<double> times;
  for (std::size_t i = 0; i < still.edges.size(); ++i) {
    times.push_back(static_cast<double>(i) / 23.0 - 0.5);
  }
  const MovingProblem problem(still, times, 10.0);
  MovingProblem::Parameters x;
  x << RefinementProblem::Pack(MakeSuperquadric(0.3, 0.4)), 0.2, -0.1, 0.05;
  x.segment<2>(RefinementProblem::kTaper).setConstant(-0.1);  // away from their bound
  const int rows = problem.NumResiduals();
  Eigen::VectorXd residuals(rows);
  Eigen::MatrixXd jacobian(rows, 18);
  ASSERT_TRUE(problem(x.data(), residuals.data(), jacobian.data()));
  for (int i = 0; i < 18; ++i) {
    constexpr double kStep = 1e-6;
    Eigen::VectorXd below(rows);
    Eigen::VectorXd above(rows);
    problem((x - kStep * MovingProblem::Parameters::Unit(i)).eval().data(), below.data(), nullptr);
    problem((x + kStep * MovingProblem::Parameters::Unit(i)).eval().data(), above.data(), nullptr);
    const Eigen::VectorXd numeric = (above - below) / (2.0 * kStep);
    EXPECT_LT((jacobian.col(i) - numeric).cwiseAbs().maxCoeff(), 1e-3 * (1.0 + numeric.cwiseAbs().maxCoeff()))
        << "parameter " << i;
  }
}

TEST(RefinementProblem, UnpacksToThePackedSolid) {
  const PosedSuperquadric s = MakeSuperquadric(0.4, 1.3);
  const PosedSuperquadric same = RefinementProblem::Unpack(RefinementProblem::Pack(s));
  EXPECT_LT((same.shape.half_size - s.shape.half_size).norm(), 1e-12);
  EXPECT_NEAR(same.shape.e1, s.shape.e1, 1e-12);
  EXPECT_NEAR(same.shape.e2, s.shape.e2, 1e-12);
  EXPECT_LT((same.T_map_object.translation - s.T_map_object.translation).norm(), 1e-12);
  EXPECT_LT(same.T_map_object.rotation.angularDistance(s.T_map_object.rotation), 1e-12);
}

TEST(RefinementProblem, MatchesCovarianceOfTheMeasurements) {
  // A box on the floor whose height above it is measured once: half of it is as uncertain as half the height.
  RefinementProblem problem;
  problem.max_log_half.setConstant(1.0);
  problem.min_log_half.setConstant(-9.0);
  problem.prior.exponents = {0.5, 0.5};
  problem.prior.exponent_factors = {5.0, 5.0};
  problem.prior.yaw = 0.6;
  problem.prior.yaw_factor = 4.0;
  problem.prior.bias_factor = 1e6;
  const PosedSuperquadric box = MakeSuperquadric(0.5, 0.5);
  const double bottom = box.T_map_object.translation.z() - box.shape.half_size.z();
  problem.contact = RefinementProblem::Contact{bottom, 1.0 / 0.02, true};
  // Level cameras far away on all sides: planes that touch top and bottom.
  for (int i = 0; i < 8; ++i) {
    const double angle = 0.8 * i;
    const Eigen::Vector3d towards(std::cos(angle), std::sin(angle), 0.0);
    const Eigen::Vector3d camera = box.T_map_object.translation - 1000.0 * towards;
    for (const double up : {1.0, -1.0}) {
      const Eigen::Vector3d normal(0.0, 0.0, up);
      problem.edges.push_back({normal - up * up * box.shape.half_size.z() / 1000.0 * towards, camera, towards,
                               1000.0 / 0.01, up > 0.0 ? 1 : 3, 1.0, true});
    }
  }
  const auto covariance = problem.Covariance(RefinementProblem::Pack(box));
  EXPECT_NEAR(std::sqrt(covariance(7, 7)), 0.2, 0.02);  // exponents: as before
  EXPECT_NEAR(std::sqrt(covariance(6, 6)), 0.25, 0.02);
  EXPECT_LT(std::sqrt(covariance(5, 5)), 0.02);
  EXPECT_LT(std::sqrt(covariance(2, 2)), 0.02);
  EXPECT_TRUE(covariance.isApprox(covariance.transpose(), 1e-9));
}

// The bound on the sizes holds them, but says nothing about how well they are known.
TEST(RefinementProblem, DoesNotTakeBoundsForMeasurements) {
  RefinementProblem problem;
  const PosedSuperquadric box = MakeSuperquadric(0.5, 0.5);
  problem.max_log_half = box.shape.half_size.array().log() - 0.1;
  problem.min_log_half.setConstant(-9.0);
  EXPECT_GT(std::sqrt(problem.Covariance(RefinementProblem::Pack(box))(3, 3)), 10.0);
}

TEST(RefinementProblem, PenalisesYawMostAtAnEighthOfATurn) {
  RefinementProblem problem;
  problem.max_log_half.setConstant(1.0);
  problem.min_log_half.setConstant(-9.0);
  problem.prior.yaw_factor = 4.0;
  const auto cost = [&](double yaw) {
    RefinementProblem::Parameters x = RefinementProblem::Pack(MakeSuperquadric(0.3, 0.3));
    x[RefinementProblem::kYaw] = yaw;
    Eigen::VectorXd residuals(problem.NumResiduals());
    problem(x.data(), residuals.data(), nullptr);
    return 0.5 * residuals.squaredNorm();
  };
  EXPECT_NEAR(cost(0.0), 0.0, 1e-12);
  EXPECT_NEAR(cost(M_PI / 2.0), 0.0, 1e-12);  // a quarter turn is the same yaw
  // One object in five has its yaw anywhere in the quarter turn.
  const auto density = [](double off) {
    return 0.8 * 4.0 / std::sqrt(2.0 * M_PI) * std::exp(-0.5 * 16.0 * off * off) + 0.2 * 2.0 / M_PI;
  };
  EXPECT_NEAR(cost(0.01), std::log(density(0.0) / density(0.01)), 1e-6);
  EXPECT_NEAR(cost(M_PI / 4.0), std::log(density(0.0) / density(0.5)), 1e-6);
  for (const double yaw : {0.1, 0.4, 0.7}) {
    EXPECT_LT(cost(yaw), cost(M_PI / 4.0));
  }
}

TEST(RefinementProblem, ExplainsRepeatedEdgeErrorByBias) {
  // Level cameras before and beside the solid that box it a hundred times each.
  const PosedSuperquadric solid = MakeSuperquadric(0.3, 0.3);
  const auto width_sigma = [&](double bias_factor) {
    RefinementProblem problem;
    problem.max_log_half.setConstant(1.0);
    problem.min_log_half.setConstant(-9.0);
    problem.prior.exponent_factors = {100.0, 100.0};
    problem.prior.yaw_factor = 100.0;
    problem.prior.width_factor = problem.prior.height_factor = 100.0;
    problem.prior.yaw = YawOf(solid.T_map_object.rotation);
    problem.prior.bias_factor = bias_factor;
    for (const Eigen::Vector3d& forward : {Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(-1, 0, 0)}) {
      for (const double outward : {-1.0, 1.0}) {
        const Eigen::Vector3d right = outward * forward.cross(Eigen::Vector3d::UnitZ());
        const Eigen::Vector3d offset = 10.0 * forward;
        Eigen::Vector3d normal = right;
        for (int i = 0; i < 5; ++i) {  // turned until the plane touches
          normal = right - SupportExtent(solid, normal) / offset.norm() * forward;
        }
        const RefinementProblem::Edge edge{
            normal, solid.T_map_object.translation - offset, forward, 1000.0, outward < 0.0 ? 0 : 2, 200.0,
            true};
        problem.edges.insert(problem.edges.end(), 100, edge);
      }
    }
    return std::sqrt(problem.Covariance(RefinementProblem::Pack(solid))(3, 3));
  };
  // A hundred boxes make a size no surer than the detector's habit allows.
  EXPECT_GT(width_sigma(1.0 / 0.02), 3.0 * width_sigma(1e6));
}

TEST(RefinementProblem, GivesZeroResidualOnTheFreeSide) {
  RefinementProblem problem;
  problem.max_log_half.setConstant(1.0);
  problem.min_log_half.setConstant(-9.0);
  problem.edges.push_back({{1, 0, 0}, {0, -4, 0}, {0, 1, 0}, 100.0, 2, 1.0, false});  // through the middle
  problem.points.push_back({{0, 0, 2}, 40.0, 1.0, false});                            // far outside
  problem.contact = RefinementProblem::Contact{-5.0, 20.0, false};
  const RefinementProblem::Parameters x = RefinementProblem::Pack(MakeSuperquadric(0.5, 0.5));
  Eigen::VectorXd residuals(problem.NumResiduals());
  problem(x.data(), residuals.data(), nullptr);
  EXPECT_EQ(residuals.head<3>(), Eigen::Vector3d::Zero());
  problem.edges[0].exact = true;
  problem.points[0].on_surface = true;
  problem.contact->exact = true;
  problem(x.data(), residuals.data(), nullptr);
  EXPECT_GT(residuals.head<3>().cwiseAbs().minCoeff(), 1.0);
}

}  // namespace
}  // namespace sqslam
