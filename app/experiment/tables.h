#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/experiment/runner.h"
#include "slam/evaluation/table.h"

namespace sqslam::app {

// Medians and ranges over the repetitions, as the tables of the paper:
//   I    3D IoU of each object class (label), and of the objects that the configuration names, by
//        representation
//   II   mean 3D IoU of each sequence by representation: over the objects found, their number, and,
//        if any is missed, the mean with 0 for each missed object; I and II also have the number of objects
//        with a 3D IoU of at least 0.25 and 0.5
//   III  landmarks by association, against ground truth
//   IV   time of tracking and mapping against the number of objects
// I, II and IV hold the runs with the association "full" (else the first one), III and IV those with
// superquadrics (else the first representation); several methods or variants are listed separately. If the
// ground truth marks objects as scored, I and II count only those. A table without runs has no rows.
Table RepresentationTable(const std::vector<CellResult>& results, const std::vector<std::string>& chosen);
Table SequenceTable(const std::vector<CellResult>& results);
Table AssociationTable(const std::vector<CellResult>& results);
Table RuntimeTable(const std::vector<CellResult>& results);

// Writes table-1.md, .tex, .csv, ..., and tables.md with all four and the failed runs. Returns the path of
// tables.md. Throws InputError if a file cannot be written.
std::filesystem::path WriteTables(const ExperimentConfig& config, const ExperimentOutcome& outcome,
                                  const std::filesystem::path& folder);

}  // namespace sqslam::app
