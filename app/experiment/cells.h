#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/experiment/config.h"
#include "slam/evaluation/evaluation.h"
#include "slam/io/result_files.h"

namespace sqslam::app {

// One run of an experiment.
struct ExperimentCell {
  std::string name;  // of its folder: the fields below joined by '-'
  std::string sequence;
  std::string representation;
  std::string association;
  std::string method;
  std::string variant;            // empty: the defaults
  int max_objects = kAllObjects;  // kAllObjects: no limit
  int repetition = 1;             // from 1
};

// Lists every combination of every grid once per repetition. Repetitions are the outer loop, so that an
// experiment that is stopped early has covered all combinations before it repeats one.
std::vector<ExperimentCell> ListCells(const ExperimentConfig& config);

// Paths in the folder of an experiment.
struct ExperimentFolder {
  std::filesystem::path path;

  std::filesystem::path Run(const ExperimentCell& cell) const { return path / "runs" / cell.name; }
  std::filesystem::path Log(const ExperimentCell& cell) const { return path / "runs" / (cell.name + ".log"); }
  std::filesystem::path Boxes(const ExperimentCell& cell) const;  // limited to those of max_objects
  std::filesystem::path Rendered(const std::string& name) const { return path / "sequences" / name; }
};

// The inputs of the cells of one sequence.
struct PreparedSequence {
  std::filesystem::path path;          // sequence folder; for a scene the folder it is rendered into
  std::filesystem::path detections;    // empty: the sequence's own
  std::vector<std::string> rendering;  // program arguments that render a scene; empty: no scene
  std::string inputs;                  // fingerprint of the input files
};

// Finds the inputs of a sequence without rendering it. Throws InputError if a scene cannot be read.
PreparedSequence Prepare(const ExperimentConfig& config, const ExperimentSequence& sequence,
                         const ExperimentFolder& folder);

// Program arguments that run a cell and evaluate it (empty: no evaluation).
struct CellCommands {
  std::vector<std::string> run;
  std::vector<std::string> eval;
};
CellCommands CommandsOf(const ExperimentConfig& config, const PreparedSequence& sequence,
                        const ExperimentCell& cell, const ExperimentFolder& folder);

// Returns all that a cell's result depends on, except the program; independent of where the experiment's
// folder is. A result made with other settings is made again.
nlohmann::ordered_json SettingsOf(const ExperimentConfig& config, const PreparedSequence& sequence,
                                  const CellCommands& commands, const ExperimentFolder& folder);

// A finished cell, as far as the tables need it.
struct CellResult {
  ExperimentCell cell;
  int jobs = 1;         // parallel runs when it was made
  std::string program;  // fingerprint of the program that made it
  RunStats stats;
  bool has_objects = false;  // evaluated against objects; otherwise all below is empty
  bool has_scored = false;   // the ground truth says which objects are scored
  int mapped = 0;
  int duplicates = 0;
  int extra = 0;
  int found_60 = 0;  // of the objects with 60 or more boxes, if boxes are counted
  int total_60 = 0;
  std::vector<ObjectScore> objects;  // by id
};

// Writes cell.json, which marks the cell as finished. Must come last.
void WriteCellRecord(const std::filesystem::path& run, const nlohmann::ordered_json& settings, int jobs,
                     const std::string& program);

// Reads a cell that finished with these settings; empty if there is none, or if its files are broken.
std::optional<CellResult> ReadCellResult(const std::filesystem::path& run, const ExperimentCell& cell,
                                         const nlohmann::ordered_json& settings);

// Returns a fingerprint of the executable, which differs between builds.
std::string ProgramFingerprint();

}  // namespace sqslam::app
