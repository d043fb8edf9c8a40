#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "slam/objects/object_options.h"
#include "slam/objects/object_types.h"
#include "slam/objects/visibility.h"

namespace sqslam {

// A detection that passed the filter, with the map points in its box that passed the depth gate.
struct BoxCandidate {
  Detection detection;
  std::vector<std::int64_t> point_ids;
  std::optional<Eigen::Vector3d> centroid;  // of the points, map frame; empty for fewer than three
  std::vector<Eigen::Vector3d> positions;   // of point_ids, map frame
  int detection_index = 0;                  // into ObjectFrame::detections
  BoxEdges edges;
  double median_depth = 0.0;  // of the points, map units; 0 if there are none
  double near_depth = 0.0;    // their lower quartile
};

// Returns true if the filter lets the detection pass: by its class, score and size. Duplicates in a frame
// are dropped later.
bool IsUsable(const Detection& detection, const Camera& camera, const DetectionFilterOptions& options);

// Returns the box's share of the image area.
double ShareOfImage(const Box2d& box, const Camera& camera);

// Drops ignored labels, low-score, tiny, huge and duplicate boxes, collects the points of each box that pass
// the depth gate, and marks edges that are cut off by the image or hidden by a nearer box.
std::vector<BoxCandidate> SelectBoxes(const ObjectFrame& frame, const DetectionFilterOptions& options,
                                      double depth_iqr);

// Depth gate (box plot): marks the depths within `iqr_factor` interquartile ranges of the quartiles. Keeps
// all if there are fewer than four or the factor is 0.
std::vector<bool> GateDepths(const std::vector<double>& depths, double iqr_factor);

}  // namespace sqslam
