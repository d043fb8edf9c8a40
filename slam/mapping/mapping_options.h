#pragma once

#include <cstdint>
#include <string>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/estimation/pose_graph.h"
#include "slam/estimation/sim3_estimation.h"
#include "slam/objects/object_options.h"
#include "slam/tracking/tracking_options.h"

namespace sqslam {

struct NewPointOptions {
  int neighbours = 15;               // covisible keyframes that are searched
  double min_baseline = 0.01;        // distance to the neighbour, in units of its median depth
  double max_parallax_cos = 0.9998;  // cosine of the angle between two rays above which no point is made
  double ratio_factor = 1.5;         // slack of the scale consistency test, in pyramid factors

  void VisitFields(auto&& visit) {
    visit("neighbours", neighbours, 1, 100);
    visit("min_baseline", min_baseline, 0.0, 1.0);
    visit("max_parallax_cos", max_parallax_cos, 0.9, 1.0);
    visit("ratio_factor", ratio_factor, 1.0, 10.0);
  }
};

struct CullingOptions {
  double min_found_ratio = 0.25;   // young points found in a smaller share of their frames are removed
  int min_observations = 3;        // keyframes that must see a point two keyframes after it was made
  double redundant_share = 0.9;    // a keyframe is redundant when so many of its points ...
  int redundant_observations = 3;  // ... are seen by so many others at the same or a finer scale

  void VisitFields(auto&& visit) {
    visit("min_found_ratio", min_found_ratio, 0.0, 1.0);
    visit("min_observations", min_observations, 2, 20);
    visit("redundant_share", redundant_share, 0.5, 1.0);
    visit("redundant_observations", redundant_observations, 2, 20);
  }
};

struct FusionOptions {
  int neighbours = 15;        // covisible keyframes
  int second_neighbours = 5;  // covisible keyframes of each of them
  double radius = 3.0;        // px at level 0

  void VisitFields(auto&& visit) {
    visit("neighbours", neighbours, 1, 100);
    visit("second_neighbours", second_neighbours, 0, 100);
    visit("radius", radius, 0.5, 50.0);
  }
};

struct LoopOptions {
  bool close = true;           // look for loop candidates after each keyframe: close loops and merge submaps
  int rest = 10;               // keyframes after a closed loop in which no further one is looked for
  int max_candidates = 5;      // keyframes that are compared with the newest
  int min_matches = 20;        // map points matched by their descriptors
  Sim3Options similarity;      // from these matches
  double search_radius = 8.0;  // px at level 0, of the search that confirms a loop
  int min_confirmed = 50;      // map points of the other side that the newest keyframe must show
  int strong_covisibility = 100;  // shared map points above which two keyframes are tied in the pose graph
  PoseGraphOptions pose_graph;
  int bundle_iterations = 10;  // iterations of the full bundle adjustment in the background after it; 0: none

  void VisitFields(auto&& visit) {
    visit("close", close);
    visit("rest", rest, 0, 1000);
    visit("max_candidates", max_candidates, 1, 100);
    visit("min_matches", min_matches, 10, 1000);
    visit("similarity", similarity);
    visit("search_radius", search_radius, 1.0, 50.0);
    visit("min_confirmed", min_confirmed, 20, 1000);
    visit("strong_covisibility", strong_covisibility, 15, 1000);
    visit("pose_graph", pose_graph);
    visit("bundle_iterations", bundle_iterations, 0, 1000);
  }
};

// The frames and submaps that a run has left over, at its end (completion.h).
struct CompletionOptions {
  int max_frames = 400;  // frames without a pose that are kept until then, 0.1 MB each; 0: nothing is tried
  int neighbours = 4;    // keyframes before and after in time that a frame is compared with
  int candidates = 6;    // keyframes that look alike that it is compared with
  int min_inliers = 20;  // map points that confirm its pose
  double keyframe_share =
      0.8;  // it becomes a keyframe where it shows fewer of its reference's points than this
  int max_tie_attempts = 30;   // keyframes of a submap that are looked for in another one
  int min_shared_points = 12;  // known to both, that tell the ratio of the two units of length
  int rounds = 5;              // of tying submaps and placing frames, while there is progress

  void VisitFields(auto&& visit) {
    visit("max_frames", max_frames, 0, 100000);
    visit("neighbours", neighbours, 1, 100);
    visit("candidates", candidates, 0, 100);
    visit("min_inliers", min_inliers, 10, 1000);
    visit("keyframe_share", keyframe_share, 0.0, 1.0);
    visit("max_tie_attempts", max_tie_attempts, 1, 10000);
    visit("min_shared_points", min_shared_points, 5, 1000);
    visit("rounds", rounds, 1, 100);
  }
};

struct MappingOptions {
  NewPointOptions new_points;
  FusionOptions fusion;
  CullingOptions culling;
  BundleAdjustmentOptions bundle_adjustment;
  JointObjectOptions joint_objects;
  LoopOptions loops;
  CompletionOptions completion;
  CameraLearningOptions camera;  // at the end of a run
  int final_iterations = 10;     // of the bundle adjustment over the whole map at the end; 0: none
  int final_frames = 120;  // frames between the keyframes that take part in it: they hold points in place
  int min_submap_keyframes = 5;  // a submap with fewer is dropped at the end, unless there is no other

  void VisitFields(auto&& visit) {
    visit("new_points", new_points);
    visit("fusion", fusion);
    visit("culling", culling);
    visit("bundle_adjustment", bundle_adjustment);
    visit("joint_objects", joint_objects);
    visit("loops", loops);
    visit("completion", completion);
    visit("camera", camera);
    visit("final_iterations", final_iterations, 0, 1000);
    visit("final_frames", final_frames, 0, 2000);
    visit("min_submap_keyframes", min_submap_keyframes, 2, 1000);
  }
};

// The options of the mapping thread.
struct MapperOptions {
  bool deterministic = false;    // nothing depends on the clock, nothing runs in the background
  std::uint64_t seed = 1;        // seeds every random source
  std::string gravity = "auto";  // see UprightEstimator
  TrackingOptions tracking;      // frames are also tracked backward and refined in the map
  MappingOptions mapping;
  ObjectOptions objects;
};

}  // namespace sqslam
