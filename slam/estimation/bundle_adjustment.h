#pragma once

#include <array>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "slam/estimation/bundle_problem.h"
#include "slam/geometry/camera.h"
#include "slam/map/map.h"

namespace sqslam {

struct BundleAdjustmentOptions {
  int max_keyframes = 16;    // keyframes that a local bundle adjustment moves
  int max_fixed = 20;        // further keyframes that hold it in place
  int iterations = 5;        // of the first, robust round
  int final_iterations = 6;  // after outliers were removed
  int threads = 1;           // of the solver

  template <typename Visitor>
  void VisitFields(Visitor&& visit) {
    visit("max_keyframes", max_keyframes, 2, 100);
    visit("max_fixed", max_fixed, 1, 100);
    visit("iterations", iterations, 1, 100);
    visit("final_iterations", final_iterations, 1, 100);
    visit("threads", threads, 1, 64);
  }
};

struct BundleAdjustmentReport {
  int keyframes = 0;
  int fixed_keyframes = 0;
  int points = 0;
  int observations = 0;
  int outliers = 0;  // observations removed from the map
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
                                              const JointObjects& objects = {});

// Parts of the camera that are learnt from a map: the focal length, and the first radial coefficient.
enum class LearntPart { kNone, kFocal, kFocalAndRadial };
constexpr auto EnumNames(LearntPart) { return std::array{"none", "focal", "focal+radial"}; }

// Options of learning the camera itself from a map.
struct CameraLearningOptions {
  LearntPart what = LearntPart::kNone;
  int iterations = 30;          // of each round
  double max_deviation = 0.02;  // standard deviation above which nothing counts as learnt, focal lengths

  template <typename Visitor>
  void VisitFields(Visitor&& visit) {
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
