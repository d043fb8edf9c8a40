#pragma once

#include "slam/estimation/two_view.h"
#include "slam/features/orb_extractor.h"
#include "slam/tracking/ignored_regions.h"
#include "slam/tracking/rolling_shutter.h"

namespace sqslam {

struct InitializationOptions {
  int min_matches = 100;       // matches between the two frames
  double search_radius = 100;  // px, around the last matched position of a feature
  TwoViewOptions two_view;

  void VisitFields(auto&& visit) {
    visit("min_matches", min_matches, 20, 10000);
    visit("search_radius", search_radius, 5.0, 1000.0);
  }
};

// Rules for new keyframes (ORB-SLAM V-E).
struct KeyframeOptions {
  double max_interval = 1.0;   // s after which a keyframe is made in any case
  int min_interval = 2;        // frames between two keyframes
  double mapped_after = 0.09;  // s of a recording until tracking sees the map with a new keyframe
  double tracked_share = 0.9;  // a keyframe is made if a smaller share of the reference's points is tracked
  int min_points = 100;  // a keyframe is made if fewer map points are tracked: they hardly hold the scale
  double urgent_share = 0.5;  // this share instead while the mapping thread is busy
  int max_pending = 2;        // keyframes that the mapping thread may lag behind

  void VisitFields(auto&& visit) {
    visit("max_interval", max_interval, 0.01, 1000.0);
    visit("min_interval", min_interval, 1, 1000);
    visit("mapped_after", mapped_after, 0.0, 10.0);
  }
};

struct RelocalizationOptions {
  bool objects = false;  // where words and descriptors fail, start from the boxes of mapped objects

  void VisitFields(auto&& visit) { visit("objects", objects); }
};

struct TrackingOptions {
  OrbOptions features;
  InitializationOptions initialization;
  KeyframeOptions keyframes;
  RollingShutterOptions rolling_shutter;
  MovingOptions moving;
  RelocalizationOptions relocalization;
  double motion_radius = 15.0;  // px at level 0, search radius around the predicted position
  int min_inliers = 25;         // map points a tracked frame needs
  int submap_after = 15;        // lost frames after which a new submap may begin

  void VisitFields(auto&& visit) {
    visit("features", features);
    visit("initialization", initialization);
    visit("keyframes", keyframes);
    visit("rolling_shutter", rolling_shutter);
    visit("moving", moving);
    visit("relocalization", relocalization);
    visit("motion_radius", motion_radius, 1.0, 200.0);
    visit("min_inliers", min_inliers, 10, 1000);
    visit("submap_after", submap_after, 1, 10000);
  }
};

}  // namespace sqslam
