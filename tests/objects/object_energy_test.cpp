#include "slam/objects/object_energy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "slam/geometry/angles.h"
#include "slam/objects/object_class.h"

namespace sqslam {
namespace {

void AddBiases(double factor, ObjectEnergy& energy) {
  for (int side = 0; side < 4; ++side) {
    energy.normals.push_back({parameter::kBias + side, factor, factor});
  }
}

// A bit of everything: exact and one-sided edges, points on the surface and outside, contact.
ObjectEnergy MakeEnergy(bool exact_contact, const SolidVariant& variant) {
  ObjectEnergy energy;
  energy.variant = variant;
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto random = [&] { return Eigen::Vector3d(unit(generator), unit(generator), unit(generator)); };
  for (int i = 0; i < 24; ++i) {
    const Eigen::Vector3d camera = 4.0 * random().normalized();
    energy.edges.push_back({random(), camera, -camera.normalized(), 100.0, i % 4, 3.0, i % 3 != 0, i % 5 == 0,
                            i / 23.0 - 0.5, i % 10 == 0});
    energy.points.push_back({0.5 * random(), 40.0, 0.7, i % 2 == 0});
  }
  energy.point_count = exact_contact ? 2.0 : 0.0;
  energy.contacts = {{-0.28, 20.0, exact_contact, -1.0}, {0.3, 30.0, true, 1.0}};
  energy.classes = {{{1.0, -1.0, 0.0}, 0.4, 3.0},
                    {{-0.5, -0.5, 1.0}, -1.5, 2.0},
                    {Eigen::Vector3d::Constant(1.0 / 3.0), -2.0, 4.0}};
  energy.exponents = {{0, 0.3, 5.0}, {1, 0.5, 6.0}};
  energy.yaws = {{0.2, 4.0}};
  AddBiases(30.0, energy);
  for (int end = 0; end < 2; ++end) {
    energy.normals.push_back({parameter::kTaper + end, 2.0, 100.0});
  }
  for (int axis = 0; axis < 3; ++axis) {  // one half size is beyond
    energy.bounds.push_back({axis, std::log(0.35) - 6.0, std::log(0.35)});
  }
  return energy;
}

PosedSuperquadric MakeSuperquadric(double e1, double e2) {
  PosedSuperquadric s;
  s.shape = {{0.3, 0.2, 0.4}, e1, e2};
  s.T_map_object = {Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitZ())), {0.05, -0.04, 0.1}};
  return s;
}

template <int kRows>
void ExpectNumericDerivatives(const ObjectEnergy& energy, const Eigen::Matrix<double, kRows, 1>& x) {
  using Jet = ceres::Jet<double, kRows>;
  constexpr double kStep = 1e-6;
  const auto rows = static_cast<std::size_t>(energy.NumResiduals());
  std::vector<Jet> jets;
  for (int i = 0; i < kRows; ++i) {
    jets.emplace_back(x[i], i);
  }
  std::vector<Jet> residuals(rows);
  energy(jets.data(), residuals.data());
  for (int i = 0; i < kRows; ++i) {
    std::vector<double> below(rows);
    std::vector<double> above(rows);
    const Eigen::Matrix<double, kRows, 1> low = x - kStep * Eigen::Matrix<double, kRows, 1>::Unit(i);
    const Eigen::Matrix<double, kRows, 1> high = x + kStep * Eigen::Matrix<double, kRows, 1>::Unit(i);
    energy(low.data(), below.data());
    energy(high.data(), above.data());
    for (std::size_t row = 0; row < rows; ++row) {
      const double numeric = (above[row] - below[row]) / (2.0 * kStep);
      EXPECT_NEAR(residuals[row].v[i], numeric, 1e-4 * (1.0 + std::abs(numeric)))
          << "residual " << row << " parameter " << i;
    }
  }
}

TEST(ObjectEnergy, HasTheDerivativesOfItsResiduals) {
  for (const SolidVariant& variant : {SolidVariant{}, SolidVariant{.tapered = true}}) {
    for (const auto& [e1, e2] :
         {std::pair(0.3, 0.4), std::pair(1.0, 1.0), std::pair(1.6, 0.2), std::pair(0.15, 1.8)}) {
      SCOPED_TRACE(::testing::Message() << e1 << " " << e2);
      SolidParameters x = PackSolid(MakeSuperquadric(e1, e2));
      x.tail<6>() << 0.02, -0.01, 0.03, 0.04, -0.3, 0.05;
      ExpectNumericDerivatives(MakeEnergy(e1 < 1.0, variant), x);
    }
  }
}

TEST(ObjectEnergy, HasTheDerivativesOfAMovingObject) {
  AllParameters x;
  x << PackSolid(MakeSuperquadric(0.3, 0.4)), 0.2, -0.1, 0.05, 0.0;
  x.segment<2>(parameter::kTaper).setConstant(-0.1);  // away from their bound
  ExpectNumericDerivatives(MakeEnergy(true, {.moving = true}), x);
}

TEST(ObjectEnergy, HasTheDerivativesOfParts) {
  const ClassTable classes = ClassTable::Named("default");
  for (const char* label : {"chair", "cup"}) {
    AllParameters x;
    x << PackSolid(MakeSuperquadric(0.3, 0.4)), 0.02, -0.03, 0.04, 0.01;
    x.segment<2>(parameter::kTaper).setConstant(-0.1);
    ObjectEnergy energy = MakeEnergy(true, {.parts = &classes.Of(label).parts.front()});
    energy.variant.tapered = std::string(label) == "cup";
    ExpectNumericDerivatives(energy, x);
  }
}

TEST(ObjectEnergy, FollowsTheDisplacementOfAMovingObject) {
  ObjectEnergy moving = MakeEnergy(true, {.moving = true});
  moving.points.clear();  // which lie at rest
  ObjectEnergy followed = moving;
  followed.variant.moving = false;
  const Eigen::Vector3d displacement(0.2, -0.1, 0.05);
  for (EdgeTerm& edge : followed.edges) {
    edge.camera_centre -= edge.time * displacement;
  }
  const SolidParameters x = PackSolid(MakeSuperquadric(0.3, 0.4));
  AllParameters x_moving;
  x_moving << x, displacement, 0.0;
  Eigen::VectorXd residuals(moving.NumResiduals());
  moving(x_moving.data(), residuals.data());
  EXPECT_NEAR(0.5 * residuals.squaredNorm(), followed.Cost(x), 1e-9);
}

// A box whose top and bottom level cameras far away on all sides see.
ObjectEnergy SeenFromAllSides(const PosedSuperquadric& box) {
  ObjectEnergy energy;
  energy.exponents = {{0, 0.5, 5.0}, {1, 0.5, 5.0}};
  energy.yaws = {{0.6, 4.0}};
  AddBiases(30.0, energy);
  for (int i = 0; i < 8; ++i) {
    const double angle = 0.8 * i;
    const Eigen::Vector3d towards(std::cos(angle), std::sin(angle), 0.0);
    const Eigen::Vector3d camera = box.T_map_object.translation - 1000.0 * towards;
    for (const double up : {1.0, -1.0}) {
      const Eigen::Vector3d normal(0.0, 0.0, up);
      energy.edges.push_back({normal - up * up * box.shape.half_size.z() / 1000.0 * towards, camera, towards,
                              1000.0 / 0.01, up > 0.0 ? 1 : 3, 1.0, true, false});
    }
  }
  return energy;
}

TEST(ObjectEnergy, WeighsEdgesByTheirInformationInTheCovarianceAlone) {
  const PosedSuperquadric box = MakeSuperquadric(0.5, 0.5);
  ObjectEnergy energy = SeenFromAllSides(box);
  energy.contacts = {{box.T_map_object.translation.z() - box.shape.half_size.z(), 1.0 / 0.02, true, -1.0}};
  // Seen from the side, width and depth are those of the class.
  const Eigen::Vector3d log_half = box.shape.half_size.array().log();
  energy.classes = {{Eigen::Vector3d::UnitX(), log_half.x(), 5.0},
                    {Eigen::Vector3d::UnitY(), log_half.y(), 5.0}};
  ObjectEnergy coarse = energy;  // with twice the standard deviations
  for (EdgeTerm& edge : coarse.edges) {
    edge.factor *= 0.5;
    edge.size *= 0.5;
  }
  const ObjectEvidence usual = EvidenceAt(PackSolid(box), energy);
  energy.edge_information = 0.25;
  const ObjectEvidence weighted = EvidenceAt(PackSolid(box), energy);
  const double variance = EvidenceAt(PackSolid(box), coarse).covariance(5, 5);
  EXPECT_GT(variance, 1.5 * usual.covariance(5, 5));
  EXPECT_NEAR(weighted.covariance(5, 5), variance, 0.01 * variance);
  EXPECT_EQ(weighted.cost, usual.cost);
}

TEST(ObjectEnergy, MatchesCovarianceOfTheMeasurements) {
  // A box on the floor whose height above it is measured once: half of it is as uncertain as half the height.
  const PosedSuperquadric box = MakeSuperquadric(0.5, 0.5);
  ObjectEnergy energy = SeenFromAllSides(box);
  const double bottom = box.T_map_object.translation.z() - box.shape.half_size.z();
  energy.contacts = {{bottom, 1.0 / 0.02, true, -1.0}};
  const auto covariance = EvidenceAt(PackSolid(box), energy).covariance;
  EXPECT_NEAR(std::sqrt(covariance(7, 7)), 0.2, 0.02);  // exponents: as before
  EXPECT_NEAR(std::sqrt(covariance(6, 6)), 0.25, 0.02);
  EXPECT_LT(std::sqrt(covariance(5, 5)), 0.02);
  EXPECT_LT(std::sqrt(covariance(2, 2)), 0.02);
  EXPECT_TRUE(covariance.isApprox(covariance.transpose(), 1e-9));
}

// The bound on the sizes holds them, but says nothing about how well they are known.
TEST(ObjectEnergy, DoesNotTakeBoundsForMeasurements) {
  ObjectEnergy energy;
  const PosedSuperquadric box = MakeSuperquadric(0.5, 0.5);
  for (int axis = 0; axis < 3; ++axis) {
    energy.bounds.push_back({axis, -9.0, std::log(box.shape.half_size[axis]) - 0.1});
  }
  EXPECT_GT(std::sqrt(EvidenceAt(PackSolid(box), energy).covariance(3, 3)), 10.0);
}

// The height and the vertical size of a unit ball are free; all else is fixed by narrow priors. Two edges see
// its top and its bottom.
class EvidenceTest : public ::testing::Test {
 protected:
  EvidenceTest() {
    for (int i = 0; i < parameter::kCount; ++i) {
      if (i != kHeight && i != kSize && i < parameter::kYaw) {
        energy_.normals.push_back({i, 1e4, 1e4});
      }
    }
    energy_.exponents = {{0, 1.0, 1e4}, {1, 1.0, 1e4}};
    AddBiases(1e4, energy_);
    for (int end = 0; end < 2; ++end) {
      energy_.normals.push_back({parameter::kTaper + end, 1e4, 1e4});
    }
    energy_.yaws = {{0.0, 1e4}};
    for (const double up : {1.0, -1.0}) {  // many, as one Cauchy loss has heavy tails; touch at 1 and -1
      const EdgeTerm edge{{0.0, -0.01, up},
                          {0.0, -100.0, 0.0},
                          {0.0, 1.0, 0.0},
                          600.0,
                          up > 0.0 ? 1 : 3,
                          1.0,
                          true,
                          true,
                          0.0,
                          true};
      energy_.edges.insert(energy_.edges.end(), 12, edge);
    }
  }

  // Negative logarithm of the integral over height and size, less that of the priors that fix the others,
  // each of which is 1.
  double Integrate() const {
    constexpr double kStep = 0.004;
    SolidParameters x = SolidParameters::Zero();
    const double free = energy_.LogNormaliser() - FixedNormaliser();
    double sum = 0.0;
    for (double height = -1.5; height < 1.5; height += kStep) {
      for (double size = -1.5; size < 1.5; size += kStep) {
        x[kHeight] = height;
        x[kSize] = size;
        sum += std::exp(-energy_.Cost(x)) * kStep * kStep;
      }
    }
    return free - std::log(sum) - std::log(1.0 - YawTerm::kMisled);  // of the yaw only the peak
  }

  double Evidence() const {
    SolidParameters x = SolidParameters::Zero();
    Minimise(energy_, 100, 1e-9, x);
    return EvidenceAt(x, energy_).cost;
  }

  double FixedNormaliser() const {
    ObjectEnergy fixed = energy_;
    fixed.contacts.clear();
    fixed.classes.clear();
    return fixed.LogNormaliser();
  }

  static constexpr int kHeight = parameter::kCentre + 2;
  static constexpr int kSize = parameter::kLogHalf + 2;
  ObjectEnergy energy_;
};

TEST_F(EvidenceTest, EqualsTheIntegralOverHeightAndSize) {
  EXPECT_NEAR(Evidence(), Integrate(), 0.1);
  energy_.contacts = {{-1.05, 30.0, true, -1.0, 3.0}};
  EXPECT_NEAR(Evidence(), Integrate(), 0.1);
  energy_.classes = {{{-0.5, -0.5, 1.0}, 0.3, 2.0}};
  EXPECT_NEAR(Evidence(), Integrate(), 0.1);
}

// A support at the height where the boxes show the end is evidence for standing there, not a cost.
TEST_F(EvidenceTest, PrefersSupportThatFits) {
  const double floating = Evidence();
  energy_.contacts = {{-1.0, 30.0, true, -1.0, 2.0}};
  EXPECT_LT(Evidence(), floating - 1.0);
  energy_.contacts.front().height = -1.4;
  EXPECT_GT(Evidence(), floating + 1.0);
}

// A wide prior fits anything, but expects it less.
TEST_F(EvidenceTest, PrefersTheNarrowPriorThatFits) {
  energy_.classes = {{{-0.5, -0.5, 1.0}, 0.0, 5.0}};
  const double narrow = Evidence();
  energy_.classes.front().factor = 1.0;
  EXPECT_GT(Evidence(), narrow + 1.0);
}

TEST(ObjectEnergy, PenalisesYawMostAtAnEighthOfATurn) {
  ObjectEnergy energy;
  energy.yaws = {{0.0, 4.0}};
  const auto cost = [&](double yaw) {
    SolidParameters x = PackSolid(MakeSuperquadric(0.3, 0.3));
    x[parameter::kYaw] = yaw;
    return energy.Cost(x);
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

TEST(ObjectEnergy, ExplainsRepeatedEdgeErrorByBias) {
  // Level cameras before and beside the solid that box it a hundred times each.
  const PosedSuperquadric solid = MakeSuperquadric(0.3, 0.3);
  const auto width_sigma = [&](double bias_factor) {
    ObjectEnergy energy;
    energy.classes = {{{1.0, -1.0, 0.0}, 0.0, 100.0}, {{-0.5, -0.5, 1.0}, 0.0, 100.0}};
    energy.exponents = {{0, 1.0, 100.0}, {1, 1.0, 100.0}};
    energy.yaws = {{YawOf(solid.T_map_object.rotation), 100.0}};
    AddBiases(bias_factor, energy);
    for (const Eigen::Vector3d& forward : {Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(-1, 0, 0)}) {
      for (const double outward : {-1.0, 1.0}) {
        const Eigen::Vector3d right = outward * forward.cross(Eigen::Vector3d::UnitZ());
        const Eigen::Vector3d offset = 10.0 * forward;
        Eigen::Vector3d normal = right;
        for (int i = 0; i < 5; ++i) {  // turned until the plane touches
          normal = right - SupportExtent(solid, normal) / offset.norm() * forward;
        }
        const EdgeTerm edge{normal,
                            solid.T_map_object.translation - offset,
                            forward,
                            1000.0,
                            outward < 0.0 ? 0 : 2,
                            200.0,
                            true,
                            false};
        energy.edges.insert(energy.edges.end(), 100, edge);
      }
    }
    return std::sqrt(EvidenceAt(PackSolid(solid), energy).covariance(3, 3));
  };
  // A hundred boxes make a size no surer than the detector's habit allows.
  EXPECT_GT(width_sigma(1.0 / 0.02), 3.0 * width_sigma(1e6));
}

TEST(ShareNoise, GrowsWithTheLogarithmOfTheSum) {
  const auto cost = [](double error) {
    std::vector<double> residuals = {error, -error, 2.0 * error, 0.0};
    ShareNoise(4.0, residuals.data(), residuals.data() + residuals.size());
    EXPECT_DOUBLE_EQ(residuals[2], -2.0 * residuals[1]);
    return std::inner_product(residuals.begin(), residuals.end(), residuals.begin(), 0.0);
  };
  EXPECT_EQ(cost(0.0), 0.0);
  EXPECT_NEAR(cost(1e-6), 5.0 * 6e-12, 1e-13);
  EXPECT_NEAR(cost(1.0), 5.0 * std::log(7.0), 1e-12);
  EXPECT_NEAR(cost(100.0) - cost(50.0), 5.0 * std::log(4.0), 0.01);
}

// Points of a bush lie anywhere in its hull, points of a box on its surface.
TEST(ObjectEnergy, FollowsPointsByHowWellTheyFit) {
  const PosedSuperquadric solid = MakeSuperquadric(0.1, 0.1);
  const auto information = [&](double noise, double count) {
    std::mt19937 generator(3);
    std::normal_distribution<double> radial(0.0, noise);
    ObjectEnergy energy;
    for (int i = 0; i < 60; ++i) {
      const Eigen::Vector3d p = solid.shape.PointAt(-1.4 + 0.047 * i, 2.4 * i);
      energy.points.push_back(
          {solid.T_map_object * (p + radial(generator) * p.normalized()), 100.0, 0.2, true});
    }
    energy.point_count = count;  // 0: as if their noise were known
    return 1.0 / EvidenceAt(PackSolid(solid), energy).covariance(0, 0);
  };
  const auto gain = [&](double count) { return information(0.005, count) / information(0.08, count); };
  EXPECT_GT(gain(12.0), 2.0 * gain(0.0));
}

TEST(ObjectEnergy, GivesZeroResidualOnTheFreeSide) {
  ObjectEnergy energy;
  energy.edges.push_back(
      {{1, 0, 0}, {0, -4, 0}, {0, 1, 0}, 100.0, 2, 1.0, false, false});  // through the middle
  energy.points.push_back({{0, 0, 2}, 40.0, 1.0, false});                // far outside
  energy.contacts = {{-5.0, 20.0, false, -1.0}};
  const SolidParameters x = PackSolid(MakeSuperquadric(0.5, 0.5));
  Eigen::VectorXd residuals(energy.NumResiduals());
  energy(x.data(), residuals.data());
  EXPECT_EQ(residuals.head<3>(), Eigen::Vector3d::Zero());
  energy.edges[0].exact = true;
  energy.points[0].on_surface = true;
  energy.contacts[0].exact = true;
  energy(x.data(), residuals.data());
  EXPECT_GT(residuals.head<3>().cwiseAbs().minCoeff(), 1.0);
}

}  // namespace
}  // namespace sqslam
