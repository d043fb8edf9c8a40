#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// The residuals of the joint refinement with their analytic Jacobian, as ceres::TinySolver asks for. Losses
// are part of the residuals: each is the signed square root of its robust cost, so that half the sum of
// squares is the cost.
class RefinementProblem {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 9 };
  using Parameters = Eigen::Matrix<double, 9, 1>;

  // Layout of the parameters: centre (map frame), log of the half sizes, yaw (radians), exponents (through a
  // sine, which keeps them between kMinShapeExponent and kMaxShapeExponent).
  enum Parameter { kCentre = 0, kLogHalf = 3, kYaw = 6, kExponents = 7 };

  // A plane through the camera centre and a box edge, which touches the object.
  struct Edge {
    Eigen::Vector3d normal_map;     // outward, scaled so that n . p is the offset in the image times depth
    Eigen::Vector3d camera_centre;  // map frame
    Eigen::Vector3d forward_map;    // viewing direction
    double factor;                  // focal length over standard deviation, both px
    bool exact;                     // false: the silhouette reaches at least to the edge
  };

  // A point on the surface, or a place that is known to lie outside of it.
  struct Point {
    Eigen::Vector3d p_map;
    double factor;  // 1 / standard deviation, map units
    double weight;
    bool on_surface;
  };

  // The lowest point of the object is at `height`, or not below.
  struct Contact {
    double height;
    double factor;  // 1 / standard deviation, map units
    bool exact;
  };

  // Prior knowledge: moderate proportions, exponents, yaw modulo 90 degrees.
  struct Prior {
    double e1;
    double e2;
    double exponent_factor;
    double yaw;
    double yaw_factor;
    double flat_log_ratio = 0.0;  // log of the shortest over the longest half size, at most
    double flat_factor = 0.0;     // 1 / standard deviation of that; 0: nothing is known
  };

  std::vector<Edge> edges;
  std::vector<Point> points;
  std::optional<Contact> contact;
  Prior prior{};
  double max_log_half = 0.0;
  double min_log_half = 0.0;

  static Parameters Pack(const PosedSuperquadric& superquadric);
  static PosedSuperquadric Unpack(const Parameters& parameters);

  // Covariance of centre, half sizes, yaw, e1 and e2 at these parameters: the inverse of J^T J. Directions
  // that nothing fixes get a large finite variance.
  Eigen::Matrix<double, 9, 9> Covariance(const Parameters& parameters) const;

  int NumResiduals() const;

  // `jacobian`: column-major, NumResiduals() x 9; may be null.
  bool operator()(const double* parameters, double* residuals, double* jacobian) const;
};

}  // namespace sqslam
