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
  int neighbours = 15;               // covisible keyframes to triangulate with
  double min_baseline = 0.01;        // distance to the neighbour, in units of its median depth
  double max_parallax_cos = 0.9998;  // cosine of the parallax angle above which no point is triangulated
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
  int min_observations = 3;        // keyframes that must observe a point two keyframes after its creation
  double redundant_share = 0.9;    // a keyframe is redundant if this share of its points ...
  int redundant_observations = 3;  // ... is seen by this many others at the same or a finer scale

  void VisitFields(auto&& visit) {
    visit("min_found_ratio", min_found_ratio, 0.0, 1.0);
    visit("min_observations", min_observations, 2, 20);
    visit("redundant_share", redundant_share, 0.5, 1.0);
    visit("redundant_observations", redundant_observations, 2, 20);
  }
};

struct FusionOptions {
  int neighbours = 15;        // covisible keyframes whose points are fused
  int second_neighbours = 5;  // covisible keyframes of each neighbour, likewise
  double radius = 3.0;        // px at level 0, search radius around a projected point

  void VisitFields(auto&& visit) {
    visit("neighbours", neighbours, 1, 100);
    visit("second_neighbours", second_neighbours, 0, 100);
    visit("radius", radius, 0.5, 50.0);
  }
};

struct LoopOptions {
  bool close = true;           // look for loop candidates after each keyframe: close loops and merge submaps
  int rest = 10;               // keyframes after a loop closure before the next search
  int max_candidates = 5;      // keyframes compared with the newest
  int min_matches = 20;        // map points matched by their descriptors
  Sim3Options similarity;      // estimated from these matches
  double search_radius = 8.0;  // px at level 0, radius of the search that verifies a loop
  int min_confirmed = 50;      // map points of the known side that the newest keyframe must match
  // Least share of the other side's points in view that an image must match, relative to the share of them
  // that the other side's own keyframe matches: what stands in two places leaves most of one place missing.
  double min_relative_share = 0.4;
  int confirming_neighbours = 2;  // of either keyframe that must match points of the other's side as well
  int min_confirmed_by_neighbour = 30;  // map points that such a neighbour must match
  int strong_covisibility = 100;        // shared map points from which two keyframes get a pose graph edge
  PoseGraphOptions pose_graph;
  int bundle_iterations = 10;  // of the background bundle adjustment after a loop closure; 0: none

  void VisitFields(auto&& visit) {
    visit("close", close);
    visit("rest", rest, 0, 1000);
    visit("max_candidates", max_candidates, 1, 100);
    visit("min_matches", min_matches, 10, 1000);
    visit("similarity", similarity);
    visit("search_radius", search_radius, 1.0, 50.0);
    visit("min_confirmed", min_confirmed, 20, 1000);
    visit("min_relative_share", min_relative_share, 0.0, 1.0);
    visit("confirming_neighbours", confirming_neighbours, 0, 20);
    visit("min_confirmed_by_neighbour", min_confirmed_by_neighbour, 10, 1000);
    visit("strong_covisibility", strong_covisibility, 15, 1000);
    visit("pose_graph", pose_graph);
    visit("bundle_iterations", bundle_iterations, 0, 1000);
  }
};

// Frames without a pose and unconnected submaps at the end of a run (completion.h).
struct CompletionOptions {
  int max_frames = 400;  // frames without a pose kept until then, 0.1 MB each; 0: completion is off
  int neighbours = 4;    // keyframes before and after in time that a frame is matched with
  int candidates = 6;    // keyframes of similar appearance that it is matched with
  int min_inliers = 20;  // map points that must confirm its pose
  double keyframe_share =
      0.8;  // a frame becomes a keyframe if it tracks less than this share of its reference's points
  int max_tie_attempts = 30;   // keyframes of a submap that are located in another one
  int min_shared_points = 12;  // shared points that determine the scale between two submaps
  int rounds = 5;              // of merging submaps and placing frames, while there is progress

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
  int final_frames = 120;        // frames between keyframes that take part in it as constraints on the points
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
  bool deterministic = false;    // no times in snapshots
  bool in_step = false;          // no dependence on the clock
  std::uint64_t seed = 1;        // seeds every random source
  std::string gravity = "auto";  // see UprightEstimator
  TrackingOptions tracking;      // for backward tracking and frame refinement
  MappingOptions mapping;
  ObjectOptions objects;
};

}  // namespace sqslam
