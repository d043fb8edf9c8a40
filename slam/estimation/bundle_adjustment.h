#pragma once

#include <functional>

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
};

// Minimises the reprojection error over a keyframe, its most covisible neighbours and all points they see;
// keyframes that see these points from outside stay fixed. Outliers leave the map. `interrupt` is asked after
// each iteration.
BundleAdjustmentReport LocalBundleAdjustment(Map& map, const Camera& camera, KeyframeId center,
                                             const BundleAdjustmentOptions& options,
                                             const std::function<bool()>& interrupt);

// The same over the whole map, the oldest keyframe fixed.
BundleAdjustmentReport GlobalBundleAdjustment(Map& map, const Camera& camera, int iterations,
                                              const BundleAdjustmentOptions& options);

}  // namespace sqslam
