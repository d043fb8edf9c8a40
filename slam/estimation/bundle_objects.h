#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "slam/geometry/superquadric.h"
#include "slam/map/map.h"

namespace sqslam {

struct BundleProblem;

// When objects take part: never, in local bundle adjustment, once over the whole map at the end, or both.
enum class JointMode { kNone, kLocal, kFinal, kBoth };
constexpr auto EnumNames(JointMode) { return std::array{"none", "local", "final", "both"}; }

// The paper's joint optimisation of shape, camera poses and points (section "Size And Shape").
struct JointObjectOptions {
  JointMode mode = JointMode::kNone;
  double sigma = 0.1;  // standard deviation of a point's radial distance to the surface, mean half sizes
  double huber = 1.0;  // distance from which on it counts linearly only, in units of sigma
  double prior = 0.1;  // standard deviation of the change of an object: place (in mean half sizes), logarithm
                       // of the half sizes, yaw (rad), exponents; large: none, as in the paper
  int min_points = 20;        // map points of an object that are being adjusted
  int min_observations = 10;  // boxes of an object

  bool Local() const { return mode == JointMode::kLocal || mode == JointMode::kBoth; }
  bool Final() const { return mode == JointMode::kFinal || mode == JointMode::kBoth; }

  template <typename Visitor>
  void VisitFields(Visitor&& visit) {
    visit("mode", mode);
    visit("sigma", sigma, 1e-4, 100.0);
    visit("huber", huber, 0.01, 1000.0);
    visit("prior", prior, 1e-4, 1e6);
    visit("min_points", min_points, 3, 100000);
    visit("min_observations", min_observations, 1, 100000);
  }
};

// An object as it is handed to bundle adjustment.
struct ObjectTerm {
  int id = 0;
  PosedSuperquadric superquadric;  // map frame
  std::vector<PointId> points;     // alive
  std::vector<double> weights;     // alpha of the paper, in [0, 1], one a point
};

// An object of a bundle adjustment, as a value.
struct BundleObject {
  struct Point {
    std::size_t index = 0;  // into BundleProblem::points
    double weight = 1.0;
  };
  struct HeldPoint {  // of the object, but not of the problem: it stays
    Eigen::Vector3d p_map;
    double weight = 1.0;
  };

  int id = 0;
  PosedSuperquadric superquadric;
  std::vector<Point> points;
  std::vector<HeldPoint> held_points;
  double sigma = 1.0;     // of the radial distance of a point of weight 1, map units
  double huber = 1.0;     // in units of sigma
  double prior = 1.0;     // see JointObjectOptions
  bool improved = false;  // fits the adjusted points better than it did before
};

// Adds the objects of which the problem adjusts enough points, in the order given.
void AddObjects(std::span<const ObjectTerm> objects, const JointObjectOptions& options, const Map& map,
                BundleProblem& problem);

// Robust sum of squared shape errors of an object with the points as they lie in the problem.
double ShapeCost(const BundleObject& object, const BundleProblem& problem);

}  // namespace sqslam
