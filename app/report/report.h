#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "render/scene/style.h"
#include "slam/evaluation/evaluation.h"
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
  const Evaluation* evaluation = nullptr;
};

// The values that a page shows; what is empty or absent leaves its section out.
struct ReportData {
  Trajectory trajectory;
  std::vector<SnapshotObject> objects;
  std::optional<RunStats> stats;
  const Evaluation* evaluation = nullptr;

  double Scale() const {  // metres per map unit
    return evaluation != nullptr ? evaluation->trajectory.S_world_map.scale : 1.0;
  }
  std::string Unit() const { return evaluation != nullptr ? "m" : "map units"; }
};

// One self-contained page: figures of the run, map.png, top view of trajectory and objects, tables of objects
// and of times, figures/*.png, all embedded; a picture that is missing is left out. Throws InputError where a
// file is broken or the page cannot be written.
void WriteReport(const ReportInputs& inputs);

// Parts of the page.

// "data:image/png;base64,..." of a file. Throws InputError where it cannot be read.
std::string DataUri(const std::filesystem::path& file, std::string_view mime_type);

// The whole page around its body, with the style sheet.
std::string HtmlPage(const std::string& title, const std::string& body);

// Top view (x to the right, y up, seen against gravity) of the camera path, the ground truth's path where
// there is one, and the outlines of the objects in their colours: an SVG element, empty where there is
// nothing to show.
std::string TopViewSvg(const ReportData& data, const LabelColors& colors);

// Cross-section and side view of one object as two small outlines.
std::string ShapeGlyphSvg(const SnapshotObject& object, const Eigen::Vector3d& color);

}  // namespace sqslam::app
