#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/experiment/experiment_cells.h"
#include "slam/io/result_files.h"

namespace sqslam::app {

// What became of one ground-truth object in one run.
struct ObjectScore {
  int id = 0;
  std::string name;  // the label where the ground truth has no name
  std::string label;
  bool scored = true;  // its 3D IoU means something
  bool found = false;
  double iou = 0.0;  // 0 where it is not found
};

// What the tables need of a finished cell.
struct CellResult {
  ExperimentCell cell;
  int jobs = 1;         // runs at a time when it was made
  std::string program;  // fingerprint of the program that made it
  RunStats stats;
  bool has_objects = false;  // held against objects; otherwise all below is empty
  bool has_scored = false;   // the ground truth says which objects are scored
  int mapped = 0;
  int doubles = 0;
  int extra = 0;
  int found_60 = 0;  // of the objects with 60 or more boxes, where boxes are counted
  int total_60 = 0;
  std::vector<ObjectScore> objects;  // by id
};

// Marks the cell as finished: cell.json, written last of all.
void WriteCellRecord(const std::filesystem::path& run, const nlohmann::ordered_json& settings, int jobs,
                     const std::string& program);

// Reads a cell that has finished with these settings; empty where it has not (never begun, stopped half-way,
// broken files, other settings).
std::optional<CellResult> ReadCellResult(const std::filesystem::path& run, const ExperimentCell& cell,
                                         const nlohmann::ordered_json& settings);

// Tells one build of the program from another: fingerprint of the executable.
std::string ProgramFingerprint();

}  // namespace sqslam::app
