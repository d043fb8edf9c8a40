#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/lie.h"

namespace sqslam {

// Chi-square quantiles: an observation with a larger squared error, in units of its variance, is an outlier.
inline constexpr double kChi2OneDof = 3.841;    // 95 %: distance from a line
inline constexpr double kChi2TwoDof = 5.991;    // 95 %: reprojection error
inline constexpr double kChi2TwoDof99 = 9.210;  // 99 %, for matches found without a search radius

inline constexpr double kMinDepth = 1e-6;  // map units; nearer points do not project

// Squared reprojection error of a point in the camera frame in units of the pixel's variance (px^2); infinite
// behind the camera.
inline double SquaredError(const Camera& camera, const Eigen::Vector3d& p_camera,
                           const Eigen::Vector2d& pixel, double variance) {
  return p_camera.z() < kMinDepth ? std::numeric_limits<double>::infinity()
                                  : (camera.Project(p_camera) - pixel).squaredNorm() / variance;
}

// Derivative of the pixel of a point in the camera frame with respect to the point (z > 0).
inline Eigen::Matrix<double, 2, 3> ProjectionJacobian(const Camera& camera, const Eigen::Vector3d& p_camera) {
  const double inverse_z = 1.0 / p_camera.z();
  Eigen::Matrix<double, 2, 3> J;
  J << camera.fx * inverse_z, 0.0, -camera.fx * p_camera.x() * inverse_z * inverse_z,  //
      0.0, camera.fy * inverse_z, -camera.fy * p_camera.y() * inverse_z * inverse_z;
  return J;
}

// Derivative of the pixel of a map point with respect to the tangent of Perturb() at the pose;
// p_camera = T_camera_map * p_map.
inline Eigen::Matrix<double, 2, 6> PoseJacobian(const Camera& camera, const Rigid3d& T_camera_map,
                                                const Eigen::Vector3d& p_camera) {
  const Eigen::Matrix<double, 2, 3> d_pixel = ProjectionJacobian(camera, p_camera);
  Eigen::Matrix<double, 2, 6> J;
  J.leftCols<3>() = -d_pixel * Skew(p_camera - T_camera_map.translation);
  J.rightCols<3>() = d_pixel;
  return J;
}

// A map point seen at a pixel.
struct PointObservation {
  Eigen::Vector3d p_map;
  Eigen::Vector2d pixel;  // undistorted
  double variance = 1.0;  // of the pixel, px^2
  bool inlier = true;     // input and output
};

// Refines T_camera_map by minimising the reprojection error of the observations (Huber, Gauss-Newton with
// analytic Jacobians, points fixed), and marks outliers; four rounds, each from the inliers of the last, as
// in the tracking of ORB-SLAM (Mur-Artal et al. 2015, section V). Returns the number of inliers.
int OptimizePose(const Camera& camera, std::vector<PointObservation>& observations, Rigid3d& T_camera_map);

// Returns the standard deviation (px) that one pixel of noise leaves where a pose determined by these points
// (in front of the camera) predicts others, at their median depth in the corners of the image; infinite if
// they do not determine a pose. Large where all of them lie in a small part of the image: another pose, far
// from this one, may then explain them as well.
double CornerDeviation(const Camera& camera, const Rigid3d& T_camera_map,
                       const std::vector<Eigen::Vector3d>& p_map);

// px: less certain poses draw the map that continues from them to a wrong place and scale.
inline constexpr double kMaxCornerDeviation = 2.0;

}  // namespace sqslam
