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
//   II   mean 3D IoU of each sequence by representation: over the objects found, how many those are, and,
//        where one is missed, with a missed object as 0
//   III  landmarks by association, against ground truth
//   IV   time of tracking and mapping against the number of objects
// I and II hold the runs with the association "full" (else the first one), III and IV those with
// superquadrics (else the first representation); methods and variants stand side by side where there are
// several. Where the ground truth marks objects as scored, I and II are of those. A table without runs has no
// rows.
Table RepresentationTable(const std::vector<CellResult>& results, const std::vector<std::string>& chosen);
Table SequenceTable(const std::vector<CellResult>& results);
Table AssociationTable(const std::vector<CellResult>& results);
Table RuntimeTable(const std::vector<CellResult>& results);

// table-1.md, .tex, .csv, ..., and tables.md, which holds all four, and what failed. Returns the path of
// tables.md. Throws InputError where they cannot be written.
std::filesystem::path WriteTables(const ExperimentConfig& config, const ExperimentOutcome& outcome,
                                  const std::filesystem::path& folder);

}  // namespace sqslam::app
