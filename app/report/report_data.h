#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/run/run_host.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::app {

// What the report's page shows of eval.json.
struct ReportEvaluation {
  nlohmann::json json;
  double scale = 1.0;  // metres per map unit
  std::vector<Eigen::Vector3d> truth_positions_map;
  bool has_objects = false;
};

// What a result folder holds, read for its page; empty or absent where the file is missing.
struct ReportData {
  std::filesystem::path folder;
  Trajectory trajectory;
  std::vector<SnapshotObject> objects;
  std::optional<RunStats> stats;
  std::optional<ReportEvaluation> evaluation;
  std::map<std::string, std::string> colors;  // "#rrggbb" of each label, as in the pictures of the map

  double Scale() const { return evaluation ? evaluation->scale : 1.0; }
  std::string_view Unit() const { return evaluation ? "m" : "map units"; }
};

// `run`: taken for what the folder holds of it, if given. Throws InputError that names the broken file.
ReportData ReadReportData(const std::filesystem::path& folder, const FinishedRun* run);

// Top view (x to the right, y up, seen against gravity) of the camera path, the ground truth's path where
// there is one, and the outlines of the objects: an SVG element.
std::string TopViewSvg(const ReportData& data);

// Cross-section and side view of one object as two small outlines.
std::string ShapeGlyphSvg(const SnapshotObject& object, std::string_view color);

}  // namespace sqslam::app
