#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

struct Sim3Options {
  int ransac_iterations = 300;  // samples at most
  double confidence = 0.99;     // probability of an outlier-free sample at which RANSAC stops early
  int min_inliers = 20;         // matches that must agree with the similarity
  std::uint64_t seed = 1;       // of the random samples

  void VisitFields(auto&& visit) {
    visit("ransac_iterations", ransac_iterations, 1, 100000);
    visit("confidence", confidence, 0.5, 0.999999);
    visit("min_inliers", min_inliers, 3, 10000);
    visit("seed", seed);
  }
};

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
};

// Estimates the similarity between two cameras from matched map points: RANSAC over triples in closed form
// (Umeyama 1991), each better hypothesis refined by the reprojection errors of its loose inliers (Chum et al.
// 2003). A match is an inlier if each point, moved into the other camera, is in front of it and reprojects
// within the 99 % quantile of the pixel noise (as in Mur-Artal and Tardos, ORB-SLAM2, 2017). Deterministic
// for a seed. Empty if there are fewer than min_inliers.
std::optional<Sim3Estimate> EstimateSim3(const Camera& camera, const std::vector<Sim3Match>& matches,
                                         const Sim3Options& options);

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
