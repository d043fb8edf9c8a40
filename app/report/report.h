#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/run/run_host.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::app {

struct ReportInputs {
  std::filesystem::path result;  // result folder; report.html is written into it
  std::string title;             // empty: the name of the sequence, or of the result folder
  std::string sequence;          // what was mapped, as shown under the title; empty: as the recording says
  std::filesystem::path video;   // embedded if smaller than 8 MiB; empty: growth.mp4 or map.mp4 if there
  const FinishedRun* run = nullptr;  // the run that was just made: its values instead of its files
};

// The values that a page shows; what is empty or absent leaves its section out.
struct ReportData {
  struct Evaluation {
    nlohmann::json json;  // eval.json
    double scale = 1.0;   // metres per map unit
    std::vector<Eigen::Vector3d> truth_positions_map;
    bool has_objects = false;
  };
  Trajectory trajectory;
  std::vector<SnapshotObject> objects;
  std::optional<RunStats> stats;
  std::optional<Evaluation> evaluation;

  double Scale() const { return evaluation ? evaluation->scale : 1.0; }
  std::string Unit() const { return evaluation ? "m" : "map units"; }
};

// Reads a result folder, but takes from `run`, if given, what it would read of it. Throws InputError that
// names the broken file.
ReportData ReadReportData(const std::filesystem::path& folder, const FinishedRun* run);

// One self-contained page: figures of the run, map.png, top view of trajectory and objects, tables of objects
// and of times, figures/*.png, all embedded; a picture that is missing is left out. Throws InputError where a
// file is broken or the page cannot be written.
void WriteReport(const ReportInputs& inputs);

}  // namespace sqslam::app
