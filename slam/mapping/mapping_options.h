#pragma once

#include <cstdint>
#include <string>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/mapping/loop_options.h"
#include "slam/objects/object_options.h"
#include "slam/tracking/tracking_options.h"

namespace sqslam {

struct NewPointOptions {
  int neighbours = 15;               // covisible keyframes that are searched
  double min_baseline = 0.01;        // distance to the neighbour, in units of its median depth
  double max_parallax_cos = 0.9998;  // cosine of the angle between two rays above which no point is made
  double ratio_factor = 1.5;         // slack of the scale consistency test, in pyramid factors

  template <typename Visitor>
  void VisitFields(Visitor&& visit) {
    visit("neighbours", neighbours, 1, 100);
    visit("min_baseline", min_baseline, 0.0, 1.0);
    visit("max_parallax_cos", max_parallax_cos, 0.9, 1.0);
    visit("ratio_factor", ratio_factor, 1.0, 10.0);
  }
};

struct CullingOptions {
  double min_found_ratio =
      0.25;                      // young points found in fewer of the frames that should see them are removed
  int min_observations = 3;      // keyframes that must see a point two keyframes after it was made
  double redundant_share = 0.9;  // a keyframe is redundant when so many of its points ...
  int redundant_observations = 3;  // ... are seen by so many others at the same or a finer scale

  template <typename Visitor>
  void VisitFields(Visitor&& visit) {
    visit("min_found_ratio", min_found_ratio, 0.0, 1.0);
    visit("min_observations", min_observations, 2, 20);
    visit("redundant_share", redundant_share, 0.5, 1.0);
    visit("redundant_observations", redundant_observations, 2, 20);
  }
};

struct FusionOptions {
  int neighbours = 15;        // covisible keyframes
  int second_neighbours = 5;  // of each of them
  double radius = 3.0;        // px at level 0

  template <typename Visitor>
  void VisitFields(Visitor&& visit) {
    visit("neighbours", neighbours, 1, 100);
    visit("second_neighbours", second_neighbours, 0, 100);
    visit("radius", radius, 0.5, 50.0);
  }
};

struct MappingOptions {
  NewPointOptions new_points;
  FusionOptions fusion;
  CullingOptions culling;
  BundleAdjustmentOptions bundle_adjustment;
  JointObjectOptions joint_objects;
  LoopOptions loops;
  CameraLearningOptions camera;  // at the end of a run
  int final_iterations = 10;     // of the bundle adjustment over the whole map at the end of a run; 0: none
  int min_submap_keyframes = 5;  // a submap with fewer is dropped at the end, unless there is no other

  template <typename Visitor>
  void VisitFields(Visitor&& visit) {
    visit("new_points", new_points);
    visit("fusion", fusion);
    visit("culling", culling);
    visit("bundle_adjustment", bundle_adjustment);
    visit("joint_objects", joint_objects);
    visit("loops", loops);
    visit("camera", camera);
    visit("final_iterations", final_iterations, 0, 1000);
    visit("min_submap_keyframes", min_submap_keyframes, 2, 1000);
  }
};

// All that the mapping thread is told of a run.
struct MapperOptions {
  bool deterministic = false;    // nothing depends on the clock, nothing runs in the background
  std::uint64_t seed = 1;        // of every random source
  std::string gravity = "auto";  // see UprightEstimator
  TrackingOptions tracking;      // frames are also tracked backward and refined in the map
  MappingOptions mapping;
  ObjectOptions objects;
};

}  // namespace sqslam
