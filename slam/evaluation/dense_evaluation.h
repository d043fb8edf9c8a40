#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "slam/evaluation/ground_truth.h"
#include "slam/evaluation/trajectory_error.h"

namespace sqslam {

struct DenseEvaluationOptions {
  double min_hull_fill = 0.975;  // solids with a lower hull_fill do not show the true surface
  // Solids are hollow if the median point is farther inside, metres: hulls of an object that one looks into,
  // such as a shelf.
  double max_inside = 0.03;
  int stride = 2;  // every n-th pixel in both directions is evaluated

  void VisitFields(auto&& visit) {
    visit("min_hull_fill", min_hull_fill, 0.0, 1.0);
    visit("max_inside", max_inside, 0.0, 100.0);
    visit("stride", stride, 1, 100);
  }
};

// Distances, in the unit of the ground truth.
struct DistanceSummary {
  int count = 0;
  double median = 0.0;
  double p90 = 0.0;
};

// Evaluation of the depth maps of a densified run against the ground truth.
struct DenseEvaluation {
  int keyframes = 0;
  double complete = 0.0;  // share of the pixels of all keyframes with a measured depth
  double filled = 0.0;    // share of the pixels with a depth filled by a plane
  DistanceSummary measured;
  DistanceSummary by_plane;         // of the pixels that a plane filled
  DistanceSummary in_hollow;        // of the points of hollow solids, which `measured` and `by_plane` exclude
  std::vector<std::string> hollow;  // names of the hollow solids
  double tested = 0.0;              // share of the pixels whose depth could be compared with the truth
  std::optional<double> top;  // root mean square distance of the 95 % of the points of the table top nearest
                              // to their own plane; empty without a table that is known
};

// Points are transformed into the world frame by the similarity that aligns the trajectory. The truth of a
// pixel is the first surface of the KnownSurfaces that its ray from the true pose hits; its error is the
// distance of the point to that surface. For a sequence with a cloud (dense.ply, world frame) it is the
// distance to the nearest point of the cloud instead. Pixels that show something else are left out.
//
// Throws InputError if the result has no depth maps or its trajectory cannot be aligned.
DenseEvaluation EvaluateDense(const std::filesystem::path& result, const std::filesystem::path& sequence,
                              const DenseEvaluationOptions& options = {});

// Lines for the terminal.
std::string FormatDense(const DenseEvaluation& evaluation);

// dense_eval.json.
void WriteDenseEvaluation(const std::filesystem::path& path, const DenseEvaluation& evaluation);

}  // namespace sqslam
