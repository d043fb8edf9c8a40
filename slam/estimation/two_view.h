#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

struct TwoViewOptions {
  int min_points = 50;  // points whose depth the two views determine
};

struct TwoViewMatch {
  Eigen::Vector2d pixel1;  // undistorted
  Eigen::Vector2d pixel2;
};

struct TwoViewGeometry {
  Rigid3d T_camera2_camera1;                           // translation of unit length
  std::vector<std::optional<Eigen::Vector3d>> points;  // per match, in the frame of camera 1
  int determined = 0;                                  // points with enough parallax to determine their depth
  // Standard deviation of the direction of the translation for one pixel of noise, rad: large where a
  // rotation explains the matches nearly as well, as for a plane.
  double direction_deviation = std::numeric_limits<double>::infinity();
};

struct TwoViewReport {
  std::optional<TwoViewGeometry> geometry;
  std::string refusal;  // if geometry is empty: the reason, for users
};

// Returns the median distance in pixels between the second pixels and the first ones rotated by the
// best-fitting rotation: near the noise for a purely rotating camera, whatever the scene.
double FlowWithoutRotation(const Camera& camera, const std::vector<TwoViewMatch>& matches);

// Matches of two images that one motion of the camera explains.
struct EpipolarSupport {
  std::vector<int> inliers;                       // indices of the matches
  bool only_turns = false;                        // a rotation explains nearly all of them
  Eigen::Matrix3d F21 = Eigen::Matrix3d::Zero();  // p2^T F21 p1 = 0 for pixels; zero if it is not determined
  // R_camera2_camera1: the rotation if the camera only turns, else those of the essential matrix, one of
  // which is right (Hartley and Zisserman, 9.6.2); none if neither is determined.
  std::vector<Eigen::Quaterniond> rotations;
};

// Returns the matches that the best essential matrix explains, or a rotation; none if there are too few.
EpipolarSupport FindEpipolarSupport(const Camera& camera, const std::vector<TwoViewMatch>& matches);

// Returns how many matches of distorted pixels one fundamental matrix explains, roughly: where they are few,
// no camera's essential matrix explains more, and a tenth of the time tells.
std::size_t FundamentalSupport(const std::vector<TwoViewMatch>& raw_matches);

// Estimates relative pose and structure of two views. The motions of the best homography (planar scenes,
// small parallax) and of the best essential matrix compete, as in ORB-SLAM (Mur-Artal et al. 2015, section
// IV), but by the epipolar errors of all matches, each after refinement: a homography has two motions, and
// the points of its plane fit both. Refused if too few points have enough parallax to determine their depth,
// or if another motion explains the matches nearly as well. Most of a scene may be too far away for that, as
// for a car that drives forward: such points fit any depth.
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
