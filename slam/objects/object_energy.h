#pragma once

#include <Eigen/Core>
#include <array>
#include <numbers>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/objects/object_class.h"
#include "slam/objects/object_options.h"
#include "slam/objects/object_terms.h"

namespace sqslam {

// One view of an object.
struct SilhouetteView {
  Rigid3d T_map_camera;
  Box2d box;                         // undistorted px
  std::array<bool, 4> edge_exact{};  // left, top, right, bottom: silhouette ends there (else it may go on)
  double time = 0.0;                 // from -0.5 at the first view of the object to 0.5 at the last
};

// The energy of one object: half the sum of squares of its terms. Derivatives are Ceres' automatic ones. A
// new kind of evidence is a new term and a list of them here.
struct ObjectEnergy {
  std::vector<EdgeTerm> edges;
  std::vector<PointTerm> points;
  std::vector<ContactTerm> contacts;
  std::vector<ClassTerm> classes;
  std::vector<ExponentTerm> exponents;
  std::vector<YawTerm> yaws;
  std::vector<NormalTerm> normals;
  std::vector<BoundTerm> bounds;  // last, as the covariance leaves them out
  double point_count = 0.0;       // independent ones, see ShareNoise(); 0: their noise is known
  double edge_information = 1.0;  // of an edge in the covariance, see EdgeInformation()
  SolidVariant variant;

  // Adds the terms of the edges of a view's box.
  void AddEdges(const SilhouetteView& view, const Camera& camera, const RefinementOptions& options);

  // Adds the terms of the proportions of a hull, whose longer horizontal axis is `longer` (0: x, 1: y).
  void AddProportions(const SizePrior& known, int longer = 0);

  int NumResiduals() const {
    return static_cast<int>(edges.size() + points.size() + contacts.size() + classes.size() +
                            exponents.size() + yaws.size() + normals.size() + bounds.size());
  }

  // Computes the residuals. Inlining all of it halves the time of the Jets.
  template <typename T>
  [[gnu::flatten]] bool operator()(const T* x, T* residuals) const {
    const ObjectSolid<T> solid(x, variant);
    const auto put = [&](const auto& terms) {
      for (const auto& term : terms) {
        *residuals++ = term(solid, x);
      }
    };
    put(edges);
    T* const of_points = residuals;
    put(points);
    if (point_count > 0.0 && !points.empty()) {
      ShareNoise(point_count, of_points, residuals);
    }
    put(contacts);
    put(classes);
    put(exponents);
    put(yaws);
    put(normals);
    put(bounds);
    return true;
  }

  double Cost(const Eigen::Ref<const Eigen::VectorXd>& x) const;

  // Sum over the priors; without lines the yaw lies anywhere in kYawRange.
  double LogNormaliser() const;

  static constexpr double kYawRange = 0.5 * std::numbers::pi;  // radians: a quarter turn shows all of a hull
};

// Minimises the energy by Levenberg-Marquardt from `x`, which it updates; returns the final cost. Steps that
// reduce it by less than `cost_tolerance` are the last. `x` has variant.NumParameters() rows.
template <int kRows>
double Minimise(const ObjectEnergy& energy, int max_iterations, double cost_tolerance,
                Eigen::Matrix<double, kRows, 1>& x);

// Evidence of the terms for an object at rest, by Laplace's approximation at the minimum.
struct ObjectEvidence {
  // Negative logarithm of the integral of the likelihood times the density of the priors: comparable between
  // hypotheses on the same measurements.
  double cost;

  // Covariance of centre, half sizes, yaw, e1 and e2: the inverse of J^T J without the bounds of the sizes,
  // which are no measurements, and with edges weighted by `edge_information`. Unobserved directions get a
  // large finite variance.
  Eigen::Matrix<double, 9, 9> covariance;
};
template <int kRows>
ObjectEvidence EvidenceAt(const Eigen::Matrix<double, kRows, 1>& minimum, const ObjectEnergy& energy);

}  // namespace sqslam
