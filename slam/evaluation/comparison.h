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

// Returns the last folder name of each path, or the paths themselves if two names are equal.
std::vector<std::string> ShortNames(const std::vector<std::filesystem::path>& paths);

// Compares results of one sequence, a column for each: summary (trajectory, counts, means), then per object
// 3D IoU, footprint IoU of thin objects, and errors of centre, size and yaw; then all landmarks that match no
// ground-truth object. Contains only what the ground truth allows. Throws UsageError if the results were
// evaluated against different ground truth.
std::vector<Table> CompareEvaluations(const std::vector<NamedEvaluation>& results);

// Lists each object of each result in a row, matched, missed, duplicate or extra, for use in a spreadsheet.
// Metres and degrees.
Table ListObjects(const std::vector<NamedEvaluation>& results);

// Writes the comparison by the file's extension: .md, .tex, .csv (ListObjects), .json (the contents of each
// eval.json). Throws UsageError for another extension, InputError if it cannot be written.
void WriteComparison(const std::filesystem::path& path, const std::vector<NamedEvaluation>& results);

// Throws UsageError for an extension that WriteComparison does not know; call before any work is done.
void CheckComparisonPath(const std::filesystem::path& path);

}  // namespace sqslam
