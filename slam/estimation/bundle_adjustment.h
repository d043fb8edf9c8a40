#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/superquadric.h"
#include "slam/map/map.h"

namespace sqslam {

struct BundlePose {
  KeyframeId id = kNoKeyframe;
  bool fixed = false;
  Rigid3d T_camera_map;
};

struct BundlePoint {
  PointId id = kNoPoint;
  Eigen::Vector3d p_map;
  int seen_elsewhere = 0;  // observations by keyframes outside of the problem
  bool alive = true;       // false if fewer than two observations are left, including those elsewhere
};

struct BundleObservation {
  std::size_t pose = 0;  // index into BundleProblem::poses
  std::size_t point = 0;
  Eigen::Vector2d pixel;  // undistorted
  double sigma = 1.0;     // standard deviation of the pixel, px
  bool inlier = true;
  Eigen::Vector2d raw_pixel = pixel;  // as in the image
  // Before alignment. Outliers are told by it: a map may be wrong by more than an aligned keypoint, and would
  // lose two fifths of its points.
  double detected_sigma = sigma;
};

// An object of a bundle adjustment, as a value.
struct BundleObject {
  struct Point {
    std::size_t index = 0;  // into BundleProblem::points
    double weight = 1.0;
  };
  struct HeldPoint {  // a point of the object outside the problem: constant
    Eigen::Vector3d p_map;
    double weight = 1.0;
  };

  int id = 0;
  PosedSuperquadric superquadric;
  std::vector<Point> points;
  std::vector<HeldPoint> held_points;
  double sigma = 1.0;  // standard deviation of the radial distance of a point of weight 1, map units
  // Standard deviation of the object's change: place (in mean half sizes), logarithm of the half sizes, yaw
  // (rad), exponents. The paper has no such prior.
  double prior = 0.1;
  bool improved = false;  // fits the adjusted points better than before
};

// A bundle adjustment with a copy of the map data it needs, so that it can be solved on another thread while
// the map changes. Poses and points are in the order of their ids, observations in the order of their points.
struct BundleProblem {
  Camera camera;
  std::vector<BundlePose> poses;
  std::vector<BundlePoint> points;
  std::vector<BundleObservation> observations;
  std::vector<BundleObject> objects = {};  // none: reprojection errors alone
};

// Optimisations in which objects take part: none, in local bundle adjustment, once over the whole map at the
// end, or both.
enum class JointMode { kNone, kLocal, kFinal, kBoth };
constexpr auto EnumNames(JointMode) { return std::array{"none", "local", "final", "both"}; }

// The paper's joint optimisation of shape, camera poses and points (section "Size And Shape").
struct JointObjectOptions {
  JointMode mode = JointMode::kNone;
  int min_points = 20;        // minimum number of map points of an object in the problem
  int min_observations = 10;  // minimum number of boxes of an object

  bool Local() const { return mode == JointMode::kLocal || mode == JointMode::kBoth; }
  bool Final() const { return mode == JointMode::kFinal || mode == JointMode::kBoth; }

  void VisitFields(auto&& visit) { visit("mode", mode); }
};

// An object as input to bundle adjustment.
struct ObjectTerm {
  int id = 0;
  PosedSuperquadric superquadric;  // map frame
  std::vector<PointId> points;     // alive
  std::vector<double> weights;     // alpha of the paper, in [0, 1], one per point
};

struct BundleSolverOptions {
  int iterations = 5;            // of the first round, which is robust (Huber)
  int final_iterations = 6;      // of the second round, after outliers are marked
  double cost_tolerance = 1e-5;  // share of the cost: an iteration that gains less is the last of its round
};

// Extracts the keyframes `free` (variable) and `fixed`, every point that a free one sees, and all
// observations of these points in these keyframes.
BundleProblem ExtractBundleProblem(const Map& map, const Camera& camera, const std::vector<KeyframeId>& free,
                                   const std::vector<KeyframeId>& fixed);

// The same for the whole map, with the oldest keyframe fixed.
BundleProblem ExtractBundleProblem(const Map& map, const Camera& camera);

// A frame between keyframes, as input to a bundle adjustment.
struct BundleFrame {
  struct Match {
    PointId point = kNoPoint;
    Eigen::Vector2d pixel;          // undistorted
    double sigma = 1.0;             // standard deviation of the pixel, px
    double detected_sigma = sigma;  // see BundleObservation
  };
  Rigid3d T_camera_map;
  std::vector<Match> matches;
};

// Adds the objects with enough points in the problem, in the order given.
void AddObjects(std::span<const ObjectTerm> objects, const JointObjectOptions& options, const Map& map,
                BundleProblem& problem);

// Minimises reprojection and shape errors over free poses, points and objects, and marks outlier observations
// (95 % quantile). Calls `stop` after each iteration; if it returns true, the problem keeps the current state
// and the result is false. Modifies nothing but the problem. Bit-reproducible.
bool SolveBundle(BundleProblem& problem, const BundleSolverOptions& options,
                 const std::function<bool()>& stop);

// Writes the poses and points of a solved problem that still exist into the map and removes outlier
// observations. Keyframes and points that are newer than the problem stay unchanged; the map frame must be
// the same as at its extraction. Returns the number of outliers.
int ApplyBundle(const BundleProblem& problem, Map& map);

struct BundleAdjustmentOptions : BundleSolverOptions {
  int max_keyframes = 16;  // variable keyframes of a local bundle adjustment, on either side of a merge

  void VisitFields(auto&& visit) {
    visit("max_keyframes", max_keyframes, 2, 100);
    visit("iterations", iterations, 1, 100);
  }
};

struct BundleAdjustmentReport {
  bool interrupted = false;
  std::vector<std::pair<int, PosedSuperquadric>> objects;  // id and superquadric of those that fit better
};

// Objects that take part in a bundle adjustment.
struct JointObjects {
  std::span<const ObjectTerm> terms;
  JointObjectOptions options;
};

// Returns a keyframe and its most covisible neighbours, `size` in all.
std::vector<KeyframeId> LocalWindow(const Map& map, KeyframeId center, int size);

// Minimises the reprojection error over a window of keyframes and all points they see; keyframes that see
// these points from outside stay fixed (the local bundle adjustment of ORB-SLAM, Mur-Artal et al. 2015,
// section VI-D; where maps were merged, the windows of both sides make one, as in ORB-SLAM3, Campos et al.
// 2021, VI B). Outliers are removed from the map. Calls `interrupt` after each iteration. Shape errors of
// given objects are minimised jointly; the results are in the report, because the map has no objects.
BundleAdjustmentReport LocalBundleAdjustment(Map& map, const Camera& camera,
                                             const std::vector<KeyframeId>& window,
                                             const BundleAdjustmentOptions& options,
                                             const std::function<bool()>& interrupt,
                                             const JointObjects& objects = {});

// The same over the whole map, with the oldest keyframe fixed.
BundleAdjustmentReport GlobalBundleAdjustment(Map& map, const Camera& camera, int iterations,
                                              const JointObjects& objects = {},
                                              std::span<const BundleFrame> frames = {});

}  // namespace sqslam
