#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
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
  bool alive = true;       // false once fewer than two observations are left, those elsewhere included
};

struct BundleObservation {
  std::size_t pose = 0;  // index into BundleProblem::poses
  std::size_t point = 0;
  Eigen::Vector2d pixel;  // undistorted
  double sigma = 1.0;     // standard deviation of the pixel, px
  bool inlier = true;
};

// An object of a bundle adjustment, as a value.
struct BundleObject {
  struct Point {
    std::size_t index = 0;  // into BundleProblem::points
    double weight = 1.0;
  };
  struct HeldPoint {  // of the object, but not of the problem: it stays
    Eigen::Vector3d p_map;
    double weight = 1.0;
  };

  int id = 0;
  PosedSuperquadric superquadric;
  std::vector<Point> points;
  std::vector<HeldPoint> held_points;
  double sigma = 1.0;     // of the radial distance of a point of weight 1, map units
  double huber = 1.0;     // in units of sigma
  double prior = 1.0;     // see JointObjectOptions
  bool improved = false;  // fits the adjusted points better than it did before
};

// Learning of the camera itself, from observations that were undistorted as it was thought to be.
struct BundleCamera {
  bool distortion = false;     // the first radial coefficient too
  double focal_prior = 0.3;    // standard deviation of the focal length's logarithm before anything was seen
  double radial_prior = 0.15;  // of the radial coefficient, about none
};

// A bundle adjustment as a value: what it needs of a map, copied, so that it can be solved on another thread
// while the map moves on. Poses and points are in the order of their ids, observations in the order of their
// points.
struct BundleProblem {
  Camera camera;  // refined by SolveBundle() where `learnt` is set
  std::vector<BundlePose> poses;
  std::vector<BundlePoint> points;
  std::vector<BundleObservation> observations;
  std::vector<BundleObject> objects = {};   // none: reprojection errors alone
  std::optional<BundleCamera> learnt = {};  // none: the camera is as it is
};

// Times at which objects take part: never, in local bundle adjustment, once over the whole map at the end, or
// both.
enum class JointMode { kNone, kLocal, kFinal, kBoth };
constexpr auto EnumNames(JointMode) { return std::array{"none", "local", "final", "both"}; }

// The paper's joint optimisation of shape, camera poses and points (section "Size And Shape").
struct JointObjectOptions {
  JointMode mode = JointMode::kNone;
  double sigma = 0.1;  // standard deviation of a point's radial distance to the surface, mean half sizes
  double huber = 1.0;  // distance from which on it counts linearly only, in units of sigma
  double prior = 0.1;  // standard deviation of the change of an object: place (in mean half sizes), logarithm
                       // of the half sizes, yaw (rad), exponents; large: none, as in the paper
  int min_points = 20;        // map points of an object that are being adjusted
  int min_observations = 10;  // boxes of an object

  bool Local() const { return mode == JointMode::kLocal || mode == JointMode::kBoth; }
  bool Final() const { return mode == JointMode::kFinal || mode == JointMode::kBoth; }

  void VisitFields(auto&& visit) {
    visit("mode", mode);
    visit("sigma", sigma, 1e-4, 100.0);
    visit("huber", huber, 0.01, 1000.0);
    visit("prior", prior, 1e-4, 1e6);
    visit("min_points", min_points, 3, 100000);
    visit("min_observations", min_observations, 1, 100000);
  }
};

// An object as it is handed to bundle adjustment.
struct ObjectTerm {
  int id = 0;
  PosedSuperquadric superquadric;  // map frame
  std::vector<PointId> points;     // alive
  std::vector<double> weights;     // alpha of the paper, in [0, 1], one a point
};

struct BundleSolverOptions {
  int iterations = 5;        // of the first, robust round (Huber)
  int final_iterations = 6;  // after outliers were marked
  int threads = 1;           // of the solver
};

// The keyframes `free` (to be moved) and `fixed`, every point that a free one sees, and all observations of
// these points in these keyframes.
BundleProblem ExtractBundleProblem(const Map& map, const Camera& camera, const std::vector<KeyframeId>& free,
                                   const std::vector<KeyframeId>& fixed);

// The same of the whole map, the oldest keyframe fixed.
BundleProblem ExtractBundleProblem(const Map& map, const Camera& camera);

// A frame between the keyframes, as a bundle adjustment takes it.
struct BundleFrame {
  struct Match {
    PointId point = kNoPoint;
    Eigen::Vector2d pixel;  // undistorted
    double sigma = 1.0;     // standard deviation of the pixel, px
  };
  Rigid3d T_camera_map;
  std::vector<Match> matches;
};

// Adds the frames' poses and what they see of the problem's points. They hold the points better in place than
// keyframes alone do; they are no part of the map and are forgotten with the problem.
void AddFrames(std::span<const BundleFrame> frames, BundleProblem& problem);

// Adds the objects of which the problem adjusts enough points, in the order given.
void AddObjects(std::span<const ObjectTerm> objects, const JointObjectOptions& options, const Map& map,
                BundleProblem& problem);

// Moves free poses, points and objects so that the sum of reprojection and shape errors becomes least, and
// marks observations that don't fit (95 % quantile). `stop` is asked after each iteration; where it says
// true, the problem keeps what has been reached and the result is false. Touches nothing but the problem.
// With one thread, runs agree to the last bit.
bool SolveBundle(BundleProblem& problem, const BundleSolverOptions& options,
                 const std::function<bool()>& stop);

// Standard deviation of the focal length of a solved problem with `learnt`, px: from how much the errors grow
// when everything else gives way to another focal length, in units of what they are. Ends early (infinity)
// where `stop` says true.
double FocalDeviation(const BundleProblem& solved, int iterations, const std::function<bool()>& stop);

// Writes a solved problem into the map: poses and points that are still there, then removes the observations
// that don't fit. Keyframes and points that are new since the problem was extracted stay where they are; the
// map frame must be the one of then. Returns the number of observations that don't fit.
int ApplyBundle(const BundleProblem& problem, Map& map);

struct BundleAdjustmentOptions : BundleSolverOptions {
  int max_keyframes = 16;  // keyframes that a local bundle adjustment moves
  int max_fixed = 20;      // further keyframes that hold it in place

  void VisitFields(auto&& visit) {
    visit("max_keyframes", max_keyframes, 2, 100);
    visit("max_fixed", max_fixed, 1, 100);
    visit("iterations", iterations, 1, 100);
    visit("final_iterations", final_iterations, 1, 100);
    visit("threads", threads, 1, 64);
  }
};

struct BundleAdjustmentReport {
  bool interrupted = false;
  std::vector<std::pair<int, PosedSuperquadric>> objects;  // id and superquadric of those that fit better now
};

// Objects that take part in a bundle adjustment.
struct JointObjects {
  std::span<const ObjectTerm> terms;
  JointObjectOptions options;
};

// Minimises the reprojection error over a keyframe, its most covisible neighbours and all points they see;
// keyframes that see these points from outside stay fixed (the local bundle adjustment of ORB-SLAM, Mur-Artal
// et al. 2015, section VI-D). Outliers leave the map. `interrupt` is asked after each iteration. Where there
// are objects, their shape errors are minimised with it; the map doesn't hold them, so the report does.
BundleAdjustmentReport LocalBundleAdjustment(Map& map, const Camera& camera, KeyframeId center,
                                             const BundleAdjustmentOptions& options,
                                             const std::function<bool()>& interrupt,
                                             const JointObjects& objects = {});

// The same over the whole map, the oldest keyframe fixed.
BundleAdjustmentReport GlobalBundleAdjustment(Map& map, const Camera& camera, int iterations,
                                              const BundleAdjustmentOptions& options,
                                              const JointObjects& objects = {},
                                              std::span<const BundleFrame> frames = {});

// Parts of the camera that are learnt from a map: the focal length, and the first radial coefficient.
enum class LearntPart { kNone, kFocal, kFocalAndRadial };
constexpr auto EnumNames(LearntPart) { return std::array{"none", "focal", "focal+radial"}; }

// Options of learning the camera itself from a map.
struct CameraLearningOptions {
  LearntPart what = LearntPart::kNone;
  int iterations = 30;          // of each round
  double max_deviation = 0.02;  // standard deviation above which nothing counts as learnt, focal lengths

  void VisitFields(auto&& visit) {
    visit("what", what);
    visit("iterations", iterations, 1, 1000);
    visit("max_deviation", max_deviation, 0.0, 1.0);
  }
};

// Result of LearnCamera().
struct LearntCamera {
  Camera camera;                 // as it was where nothing could be learnt
  double focal = 0.0;            // px, the value found whether it is trusted or not
  double focal_deviation = 0.0;  // px
  bool trusted = false;
};

// A bundle adjustment over the whole map in which the focal length is free. Where it is found well enough the
// map is that of the camera found, which differs in its radial coefficient from what keypoints were
// undistorted by: a map that is to be kept learns the focal length alone.
LearntCamera LearnCamera(Map& map, const Camera& camera, const CameraLearningOptions& options, int threads);

}  // namespace sqslam
