#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/experiment/config.h"
#include "slam/io/result_files.h"

namespace sqslam::app {

// One run of an experiment.
struct ExperimentCell {
  std::string name;  // of its folder: all that follows, joined by '-'
  std::string sequence;
  std::string representation;
  std::string association;
  std::string method;
  std::string variant;            // empty: the defaults
  int max_objects = kAllObjects;  // kAllObjects: no limit
  int repetition = 1;             // from 1
};

// Every combination of every grid once, repetition by repetition, so that an experiment that is stopped early
// has seen all combinations before it sees one again.
std::vector<ExperimentCell> ListCells(const ExperimentConfig& config);

// The folder of an experiment.
struct ExperimentFolder {
  std::filesystem::path path;

  std::filesystem::path Run(const ExperimentCell& cell) const { return path / "runs" / cell.name; }
  std::filesystem::path Log(const ExperimentCell& cell) const { return path / "runs" / (cell.name + ".log"); }
  std::filesystem::path Boxes(const std::string& name) const { return path / "boxes" / (name + ".txt"); }
  std::filesystem::path Rendered(const std::string& name) const { return path / "sequences" / name; }
};

// The inputs of the cells of one sequence.
struct PreparedSequence {
  std::filesystem::path path;          // sequence folder; of a scene the one that it is rendered into
  std::filesystem::path detections;    // empty: the sequence's own
  std::vector<std::string> rendering;  // arguments of the program that render it; empty: it is on disk
  std::string inputs;                  // fingerprint of what a result depends on
};

// Finds the inputs of a sequence without rendering it. Throws InputError where a scene cannot be read.
PreparedSequence Prepare(const ExperimentConfig& config, const ExperimentSequence& sequence,
                         const ExperimentFolder& folder);

// The program's arguments for the run of a cell and for its evaluation (empty: none wanted).
struct CellCommands {
  std::vector<std::string> run;
  std::vector<std::string> eval;
};
CellCommands CommandsOf(const ExperimentConfig& config, const PreparedSequence& sequence,
                        const ExperimentCell& cell, const ExperimentFolder& folder);

// All that the result of a cell depends on but the program itself; the same wherever the experiment's folder
// lies. A result made with other settings is made again.
nlohmann::ordered_json SettingsOf(const ExperimentConfig& config, const PreparedSequence& sequence,
                                  const CellCommands& commands, const ExperimentFolder& folder);

// Name of the limited boxes of a cell, for ExperimentFolder::Boxes; no sequence has it.
std::string NameOfBoxes(const ExperimentCell& cell);

// The boxes.txt that a sequence is run with; throws InputError where it is none whose objects can be limited.
std::filesystem::path BoxesOf(const PreparedSequence& sequence);

// The score of one ground-truth object in one run.
struct ObjectScore {
  int id = 0;
  std::string name;  // the label where the ground truth has no name
  std::string label;
  bool scored = true;  // its 3D IoU means something
  bool found = false;
  double iou = 0.0;  // 0 where it is not found
};

// A finished cell, as far as the tables need it.
struct CellResult {
  ExperimentCell cell;
  int jobs = 1;         // runs at a time when it was made
  std::string program;  // fingerprint of the program that made it
  RunStats stats;
  bool has_objects = false;  // held against objects; otherwise all below is empty
  bool has_scored = false;   // the ground truth says which objects are scored
  int mapped = 0;
  int duplicates = 0;
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

// Fingerprint of the executable, which tells one build of the program from another.
std::string ProgramFingerprint();

}  // namespace sqslam::app
