#pragma once

#include <ceres/manifold.h>
#include <ceres/sized_cost_function.h>

#include <array>

#include "slam/geometry/camera.h"
#include "slam/geometry/lie.h"

namespace sqslam {

// A pose T_camera_map as a Ceres parameter block: quaternion x y z w, then translation.
using PoseBlock = std::array<double, 7>;

PoseBlock ToBlock(const Rigid3d& T_camera_map);
Rigid3d FromBlock(const double* block);

// A manifold of left perturbations. Cost functions write their Jacobian with respect to its tangent
// coordinates into the first columns and zero into the others; PlusJacobian is the matching selection [I; 0],
// so that their product is exact and cheap. Use its blocks only with cost functions of this convention.
class PerturbationManifold : public ceres::Manifold {
 public:
  PerturbationManifold(int ambient_size, int tangent_size)
      : ambient_size_(ambient_size), tangent_size_(tangent_size) {}
  int AmbientSize() const final { return ambient_size_; }
  int TangentSize() const final { return tangent_size_; }
  bool PlusJacobian(const double* x, double* jacobian) const final;
  bool MinusJacobian(const double* x, double* jacobian) const final;

 private:
  int ambient_size_;
  int tangent_size_;
};

// Perturb() of a PoseBlock.
class PoseManifold final : public PerturbationManifold {
 public:
  PoseManifold() : PerturbationManifold(7, 6) {}
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
};

// A pixel observation of a map point, with the camera.
struct PixelMeasurement {
  PixelMeasurement(const Camera& camera, const Eigen::Vector2d& at, double standard_deviation)
      : focal(camera.fx, camera.fy),
        center(camera.cx, camera.cy),
        pixel(at),
        weight(1.0 / standard_deviation) {}

  Eigen::Vector2d focal, center, pixel;
  double weight;
};

// Reprojection error e(T_c, p) of a map point in units of the pixel's standard deviation; parameters: pose,
// point.
class ReprojectionCost final : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  explicit ReprojectionCost(const PixelMeasurement& measured) : measured_(measured) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  PixelMeasurement measured_;
};

// Unknowns of a camera, as a parameter block: change of the log focal length, the first two coefficients of
// the lens, change of the principal point (x, y; px), and the time between the first and the last row (s).
using CameraBlock = std::array<double, 6>;

// The error of the pixel as the image has it, with the camera as a further parameter.
class CameraReprojectionCost final : public ceres::SizedCostFunction<2, 7, 3, 6> {
 public:
  // `camera`: what is assumed. `drift`: px by which the point has moved when its row is read, for each second
  // of readout.
  CameraReprojectionCost(const Camera& camera, const Eigen::Vector2d& raw_pixel, double standard_deviation,
                         const Eigen::Vector2d& drift)
      : lens_(camera.lens),
        coefficients_(camera.distortion),
        measured_(camera, raw_pixel, standard_deviation),
        drift_(drift) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  template <class T>
  Eigen::Matrix<T, 2, 1> Residual(const Eigen::Matrix<T, 3, 1>& p_camera, const T* camera) const;

  LensModel lens_;
  LensCoefficients<double> coefficients_;
  PixelMeasurement measured_;
  Eigen::Vector2d drift_;
};

}  // namespace sqslam
