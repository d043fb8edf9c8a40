#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "slam/dense/dense_options.h"
#include "slam/detection/background_detector.h"
#include "slam/mapping/mapping_options.h"
#include "slam/objects/object_options.h"
#include "slam/tracking/tracking_options.h"

namespace sqslam {

struct SystemOptions {
  bool deterministic = false;  // tracking and mapping alternate, and snapshots hold no times
  // Tracking sees the map with a new keyframe after a set time of the recording, and waits for it if need be:
  // the same images give the same map, however fast the machine. For recordings only: a camera does not
  // wait. Cannot be set by a configuration.
  bool in_step = false;
  std::int64_t seed = 1;  // seeds every random source
  // The up direction: auto (from the map itself), level-start (the first camera was held level), or the
  // direction of gravity in the first camera's frame (x right, y down, z forward) as [x, y, z].
  std::string gravity = "auto";
  // Vocabulary for place recognition: auto (the one that comes with the program), none, or a file made by
  // `sqslam vocabulary`.
  std::string vocabulary = "auto";
  DetectionOptions detection;
  TrackingOptions tracking;
  MappingOptions mapping;
  ObjectOptions objects;
  DenseOptions dense;  // of `sqslam densify` and run --dense
  // Shared by systems that map the same images one after the other, so that features and matches are found
  // once; null: not shared. Cannot be set by a configuration.
  std::shared_ptr<FeatureDatabase> database;

  void VisitFields(auto&& visit) {
    visit("deterministic", deterministic);
    visit("seed", seed, std::int64_t{0}, std::int64_t{1} << 62);
    visit("gravity", gravity);
    visit("vocabulary", vocabulary);
    visit("detection", detection);
    visit("tracking", tracking);
    visit("mapping", mapping);
    visit("objects", objects);
    visit("dense", dense);
  }
};

}  // namespace sqslam
