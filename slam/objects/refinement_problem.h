#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// The residuals of the joint refinement with their analytic Jacobian, for ceres::TinySolver. Losses are part
// of the residuals: each is the signed square root of its robust cost, so that half the sum of squares is the
// cost.
class RefinementProblem {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 15 };
  using Parameters = Eigen::Matrix<double, NUM_PARAMETERS, 1>;
  using Square = Eigen::Matrix<double, NUM_PARAMETERS, NUM_PARAMETERS>;

  // Layout of the parameters: centre (map frame), log of the half sizes, yaw (radians), exponents (through a
  // sine, which keeps them between kMinShapeExponent and kMaxShapeExponent), for each side of the boxes the
  // outward bias of the detector, share of the box size, and log of the tapers of the lower and the upper end
  // (see tapered_solid.h).
  enum Parameter { kCentre = 0, kLogHalf = 3, kYaw = 6, kExponents = 7, kBias = 9, kTaper = 13 };

  // Factor of tapers from which on the ends are as wide as the middle; no end is wider.
  static constexpr double kStraight = 100.0;

  // A plane through the camera centre and a box edge, which touches the object.
  struct Edge {
    Eigen::Vector3d normal_map;     // outward, scaled so that n . p is the offset in the image times depth
    Eigen::Vector3d camera_centre;  // map frame
    Eigen::Vector3d forward_map;    // viewing direction
    double factor;                  // focal length over standard deviation, both px
    int side;                       // 0 left, 1 top, 2 right, 3 bottom
    double size;                    // box size across the edge, in standard deviations
    bool exact;                     // false: the silhouette reaches at least to the edge
    bool whole;                     // the box shows the whole object: none of its edges is hidden or cut off
  };

  // A point on the surface, or one known to lie outside of it.
  struct Point {
    Eigen::Vector3d p_map;
    double factor;  // 1 / standard deviation, map units
    double weight;
    bool on_surface;
  };

  // The lowest point of the object (for `top` the highest) is at `height`, or if not `exact` not below it.
  struct Contact {
    double height;
    double factor;  // 1 / standard deviation, map units
    bool exact;
  };

  // Prior knowledge: proportions, size, exponents, yaw modulo 90 degrees. Factors are inverse standard
  // deviations.
  struct Prior {
    double log_width_ratio = 0.0;  // logarithm of the half sizes along x over y
    double width_factor = 0.0;
    double log_height_ratio = 0.0;  // the same along z over the geometric mean of the others
    double height_factor = 0.0;
    double log_size = 0.0;  // logarithm of the geometric mean of all three
    double size_factor = 0.0;
    std::array<double, 2> exponents = {1.0, 1.0};
    std::array<double, 2> exponent_factors = {0.0, 0.0};
    double taper_factor = kStraight;  // of the log of the tapers
    double yaw = 0.0;
    double yaw_factor = 0.0;
    double yaw_misled = 0.2;   // share of objects whose lines tell nothing, as those of a pattern
    double bias_factor = 0.0;  // of the boxes' sides
  };

  std::vector<Edge> edges;
  std::vector<Point> points;
  std::optional<Contact> contact;
  std::optional<Contact> top;
  Prior prior{};
  bool handled = false;    // a round body with a handle towards its x axis, see handled_solid.h
  bool symmetric = false;  // overshooting the edges of a whole view costs as much as falling short
  Eigen::Vector3d max_log_half = Eigen::Vector3d::Zero();
  Eigen::Vector3d min_log_half = Eigen::Vector3d::Zero();

  static Parameters Pack(const PosedSuperquadric& superquadric);
  static PosedSuperquadric Unpack(const Parameters& parameters);

  // Covariance of centre, half sizes, yaw, e1 and e2 at these parameters: the inverse of J^T J without the
  // bounds of the sizes, which are no measurements. Unobserved directions get a large finite variance.
  Eigen::Matrix<double, 9, 9> Covariance(const Parameters& parameters) const;

  // Half the log determinant of the information on centre, size and yaw: how well the data determine these,
  // the Occam factor of Laplace's approximation to the evidence.
  double HalfLogInformation(const Parameters& parameters) const;

  int NumResiduals() const;

  // `jacobian`: column-major, NumResiduals() x 15; may be null.
  bool operator()(const double* parameters, double* residuals, double* jacobian) const;

 private:
  Square Information(const Parameters& parameters, int rows) const;  // of the first residuals
};

}  // namespace sqslam
