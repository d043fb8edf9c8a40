#include "slam/scene/distance_field.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "slam/scene/distance_table.h"
#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"
#include "tests/scene/made_room.h"

namespace sqslam {
namespace {

// The nearest of a dense grid of surface points, refined around the best: no derivative, no assumption.
double DenseDistance(const PosedSuperquadric& solid, const Eigen::Vector3d& p_map) {
  constexpr int kSteps = 120, kRounds = 14;
  const Eigen::Vector3d p = (solid.T_map_object.Inverse() * p_map).cwiseAbs();
  const Superquadric& shape = solid.shape;
  // Polar angles, along which points are even: |direction / norm|.
  const auto surface = [&](double eta, double omega) {
    const double c = std::cos(omega), s = std::sin(omega);
    const double section =
        std::pow(std::pow(c, 2.0 / shape.e2) + std::pow(s, 2.0 / shape.e2), -0.5 * shape.e2);
    const double C = std::cos(eta), S = std::sin(eta);
    const double profile =
        std::pow(std::pow(C, 2.0 / shape.e1) + std::pow(S, 2.0 / shape.e1), -0.5 * shape.e1);
    return Eigen::Vector3d(shape.half_size.array() *
                           Eigen::Array3d(profile * C * section * c, profile * C * section * s, profile * S));
  };
  const double quarter = 0.5 * std::numbers::pi;
  double best = std::numeric_limits<double>::infinity();
  Eigen::Array2d low(0.0, 0.0), high(quarter, quarter);
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::Array2d step = (high - low) / kSteps;
    Eigen::Array2d at = low;
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; j <= kSteps; ++j) {
        const Eigen::Array2d angles = (low + step * Eigen::Array2d(i, j)).min(quarter).max(0.0);
        const double distance = (surface(angles[0], angles[1]) - p).norm();
        if (distance < best) {
          best = distance;
          at = angles;
        }
      }
    }
    low = (at - 8.0 * step).max(0.0);
    high = (at + 8.0 * step).min(quarter);
  }
  return shape.RadialScale(p) < 1.0 ? -best : best;
}

PosedSuperquadric RandomSolid(std::mt19937& random) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution(low, high)(random);
  };
  return {
      {{uniform(0.05, 0.5), uniform(0.05, 0.5), uniform(0.05, 0.5)}, uniform(0.1, 1.9), uniform(0.1, 1.9)},
      {Eigen::Quaterniond(Eigen::AngleAxisd(uniform(-3.0, 3.0), Eigen::Vector3d::UnitZ())),
       {uniform(-1.0, 1.0), 0.3, -0.2}}};
}

TEST(DistanceFrom, AgreesWithDenseSearch) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 40; ++i) {
    const PosedSuperquadric solid = RandomSolid(random);
    const Eigen::Vector3d p =
        solid.T_map_object * Eigen::Vector3d(Eigen::Array3d(unit(random), unit(random), unit(random)) * 1.8 *
                                             solid.shape.half_size.array());
    EXPECT_NEAR(DistanceFrom(solid, p).distance, DenseDistance(solid, p), 1e-6)
        << "solid " << i << ": " << solid.shape.half_size.transpose() << ", " << solid.shape.e1 << ' '
        << solid.shape.e2;
  }
}

TEST(DistanceFrom, GradientAgreesWithDifferences) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 200; ++i) {
    const PosedSuperquadric solid = RandomSolid(random);
    const Eigen::Vector3d direction = Eigen::Vector3d(unit(random), unit(random), unit(random)).normalized();
    const Eigen::Vector3d p = solid.T_map_object.translation +
                              solid.shape.half_size.norm() * (1.2 + 0.5 * unit(random)) * direction;
    const SurfaceDistance at = DistanceFrom(solid, p);
    if (at.distance < 0.0) {
      continue;  // beside a medial axis there is no gradient
    }
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
      const double slope =
          (DistanceFrom(solid, p + step).distance - DistanceFrom(solid, p - step).distance) / (2.0 * kStep);
      EXPECT_NEAR(at.gradient[axis], slope, 1e-4) << i;
    }
  }
}

// The plane through the nearest point, across the way to it, bounds the distance from below.
TEST(DistanceFrom, FindsNearestPointFarFromFlatAndSharpSolids) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (const auto& [e1, e2] : {std::pair(0.1, 0.1), {0.2, 0.1}, {0.1, 1.9}, {1.9, 0.5}, {1.9, 1.9}}) {
    const PosedSuperquadric solid{{{0.3, 0.2, 0.12}, e1, e2}, {}};
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector3d p(1.4 * unit(random), unit(random), 0.6 * unit(random));
      const SurfaceDistance at = DistanceFrom(solid, p);
      if (at.distance > 0.0) {
        EXPECT_NEAR(at.distance, at.gradient.dot(p) - SupportExtent(solid, at.gradient), 1e-7)
            << e1 << ' ' << e2 << ": " << p.transpose();
      }
    }
  }
}

TEST(DistanceTable, AgreesWithDistanceFromAndDenseSearch) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (const auto& [e1, e2] : {std::pair(0.1, 0.1), {0.2, 1.0}, {0.5, 0.5}, {1.0, 1.0}}) {
    const PosedSuperquadric solid{
        {{0.3, 0.2, 0.12}, e1, e2},
        {Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ())), {0.1, 0.2, 0.3}}};
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 600; ++i) {  // half of them near
      const double reach = i % 2 == 0 ? 1.3 : 6.0;
      points.emplace_back(
          solid.T_map_object *
          (reach * Eigen::Vector3d(0.3 * unit(random), 0.2 * unit(random), 0.12 * unit(random))));
    }
    std::vector<SurfaceDistance> found(points.size());
    DistanceTable(solid, 1).At(points, found);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const SurfaceDistance exact = DistanceFrom(solid, points[i]);
      EXPECT_NEAR(found[i].distance, exact.distance, 1e-6) << points[i].transpose();
      if (exact.distance > 0.0) {
        EXPECT_LT((found[i].gradient - exact.gradient).norm(), 1e-6) << points[i].transpose();
      }
    }
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_NEAR(found[i].distance, DenseDistance(solid, points[i]), 1e-6);
    }
  }
}

TEST(DistanceFrom, MatchesSpheres) {
  const PosedSuperquadric ball{{{0.2, 0.2, 0.2}, 1.0, 1.0}, {}};
  EXPECT_NEAR(DistanceFrom(ball, {0.3, 0.4, 0.0}).distance, 0.3, 1e-9);
  EXPECT_NEAR(DistanceFrom(ball, {0.03, 0.04, 0.0}).distance, -0.15, 1e-9);
  EXPECT_NEAR(DistanceFrom(ball, {0.0, 0.0, 0.0}).distance, -0.2, 1e-9);
  EXPECT_NEAR(DistanceFrom(ball, {0.0, 0.0, -0.5}).gradient.z(), -1.0, 1e-9);
}

TEST(DistanceField, TakesNearestObject) {
  const MapSnapshot map = testing::MadeRoom();
  const DistanceField field(map);
  const Eigen::Vector3d p(0.2, -0.4, 1.1);
  double nearest = 1e9;
  for (const SnapshotObject& object : map.objects) {
    nearest = std::min(nearest, DistanceFrom(object.superquadric, p).distance);
  }
  EXPECT_EQ(field.At(p).distance, nearest);
  const std::vector<Eigen::Vector3d> points(3000, p);
  std::vector<double> distances(points.size());
  std::vector<Eigen::Vector3d> gradients(points.size());
  field.At(points, distances, gradients, 2);
  EXPECT_EQ(distances, std::vector<double>(points.size(), nearest));
  EXPECT_EQ(gradients.back(), field.At(p).gradient);
  EXPECT_TRUE(std::isinf(DistanceField(MapSnapshot()).At(p).distance));
}

TEST(DistanceField, GivesManyPointsWhatItGivesOne) {
  const MapSnapshot map = testing::MadeRoom();
  const DistanceField field(map, 1.0);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Eigen::Vector3d> points(50'000);  // enough for tables of some objects
  for (Eigen::Vector3d& p : points) {
    p = {2.0 + 8.0 * unit(random), 8.0 * unit(random), 1.0 + unit(random)};
  }
  std::vector<double> distances(points.size());
  field.At(points, distances, {}, 2);
  for (std::size_t i = 0; i < points.size(); i += 100) {
    EXPECT_NEAR(distances[i], field.At(points[i]).distance, 1e-6);
  }
}

TEST(DistanceField, GrowsObjectsByTheirCovariance) {
  MapSnapshot map = testing::MadeRoom();
  map.objects.resize(1);
  map.objects[0].fit.covariance.setZero();
  map.objects[0].fit.covariance(2, 2) = 0.01 * 0.01;  // 1 cm along z only
  const Eigen::Vector3d above(0.0, 0.0, 1.0), beside(1.2, 0.0, 0.4);
  EXPECT_NEAR(DistanceField(map, 2.0).At(above).distance, DistanceField(map).At(above).distance - 0.02, 1e-9);
  EXPECT_NEAR(DistanceField(map, 2.0).At(beside).distance, DistanceField(map).At(beside).distance, 1e-6);
}

TEST(DistanceGrid, WritesNumpyArrayAndPlan) {
  const TemporaryFolder folder;
  MapSnapshot map = testing::MadeRoom();
  map.objects.resize(2);
  const DistanceGrid grid = SampleDistances(map, 0.1, 0.2, 0.0);
  const std::size_t cells = static_cast<std::size_t>(grid.size[0]) * static_cast<std::size_t>(grid.size[1]) *
                            static_cast<std::size_t>(grid.size[2]);
  ASSERT_EQ(grid.distances.size(), cells);
  WriteDistanceGrid(folder.Path() / "room.npy", grid, map);
  EXPECT_EQ(std::filesystem::file_size(folder.Path() / "room.npy") % 64, 4 * cells % 64);
  WriteOccupancyPlan(folder.Path() / "room.pgm", grid);
  std::ifstream file(folder.Path() / "room.pgm", std::ios::binary);
  std::string magic;
  int columns = 0, rows = 0;
  file >> magic >> columns >> rows;
  EXPECT_EQ(columns, grid.size[0]);
  EXPECT_EQ(rows, grid.size[1]);
  std::stringstream rest;
  rest << file.rdbuf();
  const auto black = std::ranges::count(rest.str().substr(5), '\0');
  EXPECT_NEAR(static_cast<double>(black) * 0.01, 1.6 * 1.0, 0.2);  // the table's area
  EXPECT_THROW(SampleDistances(map, 1e-4, 0.2, 0.0), UsageError);
  EXPECT_THROW(SampleDistances(MapSnapshot(), 0.1, 0.2, 0.0), InputError);
}

}  // namespace
}  // namespace sqslam
