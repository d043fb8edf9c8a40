#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "slam/evaluation/evaluation.h"
#include "slam/evaluation/table.h"

namespace sqslam {

// One of several results of the same sequence.
struct NamedEvaluation {
  std::string name;
  Evaluation evaluation;
};

// The last folder name of each path; where two are equal, the paths themselves.
std::vector<std::string> ShortNames(const std::vector<std::filesystem::path>& paths);

// Results of one sequence side by side, a column for each: summary (trajectory, counts, means), then object
// by object 3D IoU, footprint IoU of thin objects, and errors of centre, size and yaw; then all landmarks
// that are no ground-truth object. Only what the ground truth allows. Throws UsageError where the results
// were held against different ground truth.
std::vector<Table> CompareEvaluations(const std::vector<NamedEvaluation>& results);

// One row for each object of each result, matched, missed, double or extra: for further work in a table
// program. Metres and degrees.
Table ListObjects(const std::vector<NamedEvaluation>& results);

// Writes the comparison by the file's extension: .md, .tex, .csv (ListObjects), .json (the contents of each
// eval.json). Throws UsageError for another extension, InputError where it cannot be written.
void WriteComparison(const std::filesystem::path& path, const std::vector<NamedEvaluation>& results);

// The extensions that WriteComparison knows, checked before any work is done; throws UsageError.
void CheckComparisonPath(const std::filesystem::path& path);

}  // namespace sqslam
