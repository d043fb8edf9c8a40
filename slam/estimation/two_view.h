#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

struct TwoViewOptions {
  double min_parallax = 1.5;  // degrees, median over the triangulated points
  int min_points = 50;        // triangulated points

  void VisitFields(auto&& visit) { visit("min_parallax", min_parallax, 0.1, 20.0); }
};

struct TwoViewMatch {
  Eigen::Vector2d pixel1;  // undistorted
  Eigen::Vector2d pixel2;
};

struct TwoViewGeometry {
  Rigid3d T_camera2_camera1;                           // translation of unit length
  std::vector<std::optional<Eigen::Vector3d>> points;  // per match, in the frame of camera 1
  bool from_homography = false;
};

struct TwoViewReport {
  std::optional<TwoViewGeometry> geometry;
  std::string refusal;  // if geometry is empty: the reason, for users
};

// Returns the median distance in pixels between the second pixels and the first ones rotated by the
// best-fitting rotation: near the noise for a purely rotating camera, whatever the scene.
double FlowWithoutRotation(const Camera& camera, const std::vector<TwoViewMatch>& matches);

// Estimates relative pose and structure of two views, with the model selection of ORB-SLAM (Mur-Artal et al.
// 2015, section IV): a homography (planar scenes, small parallax) and a fundamental matrix are scored by
// their symmetric transfer errors; the better one gives the pose. Refused if the parallax is too small or a
// second solution explains the matches nearly as well.
TwoViewReport EstimateTwoView(const Camera& camera, const std::vector<TwoViewMatch>& matches,
                              const TwoViewOptions& options);

// Triangulates a point in the map frame from its viewing rays (z = 1, undistorted) in two cameras, by linear
// least squares (DLT).
Eigen::Vector3d Triangulate(const Rigid3d& T_camera1_map, const Eigen::Vector3d& ray1,
                            const Rigid3d& T_camera2_map, const Eigen::Vector3d& ray2);

// Returns the cosine of the angle at p_map between the directions to two camera centres.
double CosParallax(const Eigen::Vector3d& p_map, const Eigen::Vector3d& center1,
                   const Eigen::Vector3d& center2);

}  // namespace sqslam
