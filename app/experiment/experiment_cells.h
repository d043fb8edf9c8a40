#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "app/experiment/experiment_config.h"

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

// What is needed before the cells of a sequence can run.
struct PreparedSequence {
  std::filesystem::path path;          // sequence folder; of a scene the one that it is rendered into
  std::filesystem::path detections;    // empty: the sequence's own
  std::vector<std::string> rendering;  // arguments of the program that render it; empty: it is on disk
  std::string inputs;                  // fingerprint of what a result depends on
};

// Looks at the inputs of a sequence without rendering it. Throws InputError where a scene cannot be read.
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

// The lines of boxes.txt that belong to the `count` objects with the most boxes: by object ids where every
// line has one, else by labels. The comments stay.
std::string LimitBoxes(const std::filesystem::path& boxes, int count);

// The boxes.txt that a sequence is run with; throws InputError where it is none whose objects can be limited.
std::filesystem::path BoxesOf(const PreparedSequence& sequence);

// 16 hexadecimal digits (FNV-1a) by which equal texts are recognised.
std::string Fingerprint(std::string_view text);

}  // namespace sqslam::app
