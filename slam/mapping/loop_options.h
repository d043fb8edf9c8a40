#pragma once

#include "slam/estimation/pose_graph.h"
#include "slam/estimation/sim3_estimation.h"

namespace sqslam {

struct LoopOptions {
  bool close = true;              // look for known places after each keyframe: close loops and merge submaps
  int rest = 10;                  // keyframes after a closed loop in which no further one is looked for
  int max_candidates = 5;         // keyframes that are compared with the newest
  int min_matches = 20;           // map points matched by their descriptors
  Sim3Options similarity;         // from these matches
  double search_radius = 8.0;     // px at level 0, of the search that confirms a place
  int min_confirmed = 50;         // map points of the known place that the newest keyframe must show
  int strong_covisibility = 100;  // shared map points above which two keyframes are tied in the pose graph
  PoseGraphOptions pose_graph;
  int bundle_iterations = 10;  // of the full bundle adjustment in the background after it; 0: none

  template <typename Visitor>
  void VisitFields(Visitor&& visit) {
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

}  // namespace sqslam
