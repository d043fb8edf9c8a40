#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/estimation/camera_learning.h"
#include "slam/objects/object_options.h"
#include "slam/tracking/tracking_options.h"

namespace sqslam {

struct CullingOptions {
  double redundant_share = 0.9;    // a keyframe is redundant if this share of its points ...
  int redundant_observations = 3;  // ... is seen by this many others at the same or a finer scale

  void VisitFields(auto&& visit) { visit("redundant_share", redundant_share, 0.5, 1.0); }
};

struct LoopOptions {
  bool close = true;  // look for loop candidates after each keyframe: close loops and merge submaps
  // Minimum share of the other side's points in view that an image must match, relative to the share of them
  // that the other side's own keyframe matches: an object in two places matches only a part of each place.
  double min_relative_share = 0.4;
  int confirming_neighbours = 2;  // of either keyframe that must match points of the other's side as well
  int bundle_iterations = 10;     // of the background bundle adjustment after a loop closure; 0: none

  void VisitFields(auto&& visit) {
    visit("close", close);
    visit("min_relative_share", min_relative_share, 0.0, 1.0);
  }
};

// Frames without a pose and unconnected submaps at the end of a run (completion.h).
struct CompletionOptions {
  int max_frames = 400;  // frames without a pose kept until then, 0.1 MB each; 0: completion is off
  // Share of the images in the main map, below which all are mapped afresh; cannot be set by a configuration.
  double min_mapped = 0.95;

  void VisitFields(auto&& visit) { visit("max_frames", max_frames, 0, 100000); }
};

struct MappingOptions {
  CullingOptions culling;
  BundleAdjustmentOptions bundle_adjustment;
  JointObjectOptions joint_objects;
  LoopOptions loops;
  CompletionOptions completion;
  CameraLearningOptions camera;  // at the end of a run
  int final_frames = 120;  // frames between keyframes that constrain points in the last bundle adjustment

  void VisitFields(auto&& visit) {
    visit("culling", culling);
    visit("bundle_adjustment", bundle_adjustment);
    visit("joint_objects", joint_objects);
    visit("loops", loops);
    visit("completion", completion);
    visit("camera", camera);
    visit("final_frames", final_frames, 0, 2000);
  }
};

class FeatureDatabase;

// The options of the mapping thread.
struct MapperOptions {
  bool deterministic = false;    // no times in snapshots
  bool in_step = false;          // no dependence on the clock
  std::uint64_t seed = 1;        // seeds every random source
  std::string gravity = "auto";  // see UprightEstimator
  TrackingOptions tracking;      // for backward tracking and frame refinement
  MappingOptions mapping;
  ObjectOptions objects;
  std::shared_ptr<FeatureDatabase> database;  // see SystemOptions
};

}  // namespace sqslam
