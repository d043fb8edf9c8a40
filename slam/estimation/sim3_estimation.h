#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

inline constexpr int kMinSim3Inliers = 20;  // matches that must agree with a similarity

// A point observed by two cameras whose maps have drifted apart, as before a loop closure: each camera has
// its own map point for it.
struct Sim3Match {
  Eigen::Vector3d p_camera1;  // the first camera's map point in its frame, the second's in its own
  Eigen::Vector3d p_camera2;
  Eigen::Vector2d pixel1;  // where each camera sees its own point, undistorted
  Eigen::Vector2d pixel2;
  double variance1 = 1.0;  // of the pixels, px^2
  double variance2 = 1.0;
};

struct Sim3Estimate {
  Sim3d S_camera1_camera2;
  std::vector<bool> inliers;  // one per match
  int num_inliers = 0;
  double cost = 0.0;  // squared errors, truncated for outliers
};

// Estimates the similarity between two cameras from matched map points: RANSAC over triples in closed form
// (Umeyama 1991), each better hypothesis refined by the reprojection errors of its loose inliers (Chum et al.
// 2003). A match is an inlier if each point, moved into the other camera, is in front of it and reprojects
// within the 99 % quantile of the pixel noise (as in Mur-Artal and Tardos, ORB-SLAM2, 2017). Deterministic.
// Empty if there are fewer than kMinSim3Inliers.
std::optional<Sim3Estimate> EstimateSim3(const Camera& camera, const std::vector<Sim3Match>& matches);

// Refines S_camera1_camera2 by the reprojection errors of the inliers in both images, and loosely by the
// distances of the points, over all seven degrees of freedom (Levenberg-Marquardt, analytic Jacobians, the
// points fixed in the frames of their own cameras): a robust round (Huber), then two without the outliers.
// `inliers`, one per match, are the matches to begin with (empty: all), re-evaluated over all matches after
// each round. Returns the number of inliers; 0 if the problem is underdetermined, which leaves the similarity
// unchanged.
int RefineSim3(const Camera& camera, const std::vector<Sim3Match>& matches, Sim3d& S_camera1_camera2,
               std::vector<bool>& inliers);

// Residual of a match (error in image 1, then in image 2, px) and its derivative with respect to x in
// S' = Exp(x) S, see lie.h. Both points must be in front of the other camera.
struct Sim3Linearization {
  Eigen::Vector4d residual;
  Eigen::Matrix<double, 4, 7> jacobian;
};
Sim3Linearization LinearizeSim3(const Camera& camera, const Sim3d& S_camera1_camera2, const Sim3Match& match);

}  // namespace sqslam
