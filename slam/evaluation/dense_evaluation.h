#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "slam/evaluation/evaluation.h"

namespace sqslam {

// Distances that count as close, in the unit of the ground truth (metres).
inline constexpr std::array kCloseDistances = {0.01, 0.02};

// Points of a surface. With `normals`, one per point or none, distances to it are those to the plane of its
// nearest point, which do not depend on the spacing of its points; a zero normal is unknown.
struct SurfacePoints {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> normals = {};
};

// Distances of the points of one cloud to the surface of another.
struct CloudDistances {
  int points = 0;
  double median = 0.0;
  double p90 = 0.0;
  std::array<double, kCloseDistances.size()> within{};  // shares of points within these distances
};

// Returns the distance of each of `points` to `surface`; neither may be empty.
std::vector<double> DistancesTo(const SurfacePoints& surface, const std::vector<Eigen::Vector3d>& points);

// Returns quantiles and shares of distances, of which there must be one.
CloudDistances SummaryOf(const std::vector<double>& distances);

// Evaluation of a dense cloud against the true one.
struct DenseEvaluation {
  CloudDistances accuracy;      // of all estimated points, filled ones too, to the true surface
  CloudDistances completeness;  // of the true points to the nearest estimated ones
  // RMS of the accuracy's distances over the standard deviations that the cloud predicts: 1 if these hold.
  // Nothing if the cloud predicts none.
  std::optional<double> normalised_rms;
};

// Compares the result's dense.ply, aligned like the trajectory, with the sequence's (frame of
// objects_gt.json). Throws InputError if either is missing or the trajectory cannot be aligned.
DenseEvaluation EvaluateDense(const std::filesystem::path& result, const std::filesystem::path& sequence,
                              const EvaluationOptions& options = {});

// Returns lines for the terminal.
std::string FormatDense(const DenseEvaluation& evaluation);

// Writes dense_eval.json.
void WriteDenseEvaluation(const std::filesystem::path& path, const DenseEvaluation& evaluation);

}  // namespace sqslam
