#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/export/map_view.h"
#include "render/scene/style.h"
#include "slam/evaluation/evaluation.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/run/run_host.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::app {

struct ReportInputs {
  std::filesystem::path result;      // result folder; report.html is written into it
  std::string title{};               // empty: the name of the sequence, or of the result folder
  std::string sequence{};            // what was mapped, shown below the title; empty: from the recording
  std::filesystem::path video{};     // embedded up to 3 MiB; empty: growth.mp4 or map.mp4 if present
  const FinishedRun* run = nullptr;  // the run just made; replaces the files of the result folder
  const Evaluation* evaluation = nullptr;
  std::shared_ptr<const RecordingReader> changed{};  // the map with edits or fewer objects; null: as it is
  std::vector<std::string> render_options{};         // that `sqslam render` needs for the changed map
  std::filesystem::path output{};                    // empty: report.html in the result folder
};

// The values that a page shows. A section without values is left out.
struct ReportData {
  Trajectory trajectory;
  std::vector<SnapshotObject> objects;
  std::optional<RunStats> stats;
  const Evaluation* evaluation = nullptr;
  std::shared_ptr<const RecordingReader> recording;  // null: none

  std::optional<MapScale> scale;  // empty: lengths are map units

  bool IsMetric() const { return scale || evaluation != nullptr; }
  double Scale() const {  // metres per unit of length in the files; a measured scale overrides the true poses
    return !scale && evaluation != nullptr ? evaluation->trajectory.S_world_map.scale : 1.0;
  }
  std::string Unit() const { return IsMetric() ? "m" : "map units"; }
};

// Writes one self-contained page: key figures, an input image with outlines, the interactive map, a top view
// of trajectory and objects, tables, figures/*.png, and how the run was made. Whatever is missing is left
// out, as are pictures and video of the run if the map was changed. Returns the path of the page. Throws
// InputError if a file is broken or the page cannot be written.
std::filesystem::path WriteReport(const ReportInputs& inputs);

// Parts of the page.

// The input image that best shows the reliable objects, with outlines and names.
struct OutlinedPhoto {
  cv::Mat picture;
  std::string caption;
};
std::optional<OutlinedPhoto> BestPhoto(const RecordingReader& reader, const ViewHistory& history);

// Append one section with a table each: objects, comparison with the ground truth, timing.
void AppendObjects(std::string& page, const ReportData& data, const LabelColors& colors);
void AppendComparison(std::string& page, const ReportData& data, const LabelColors& colors);
void AppendTiming(std::string& page, const ReportData& data);

// Appends the likely relations between objects, surfaces and walls, most likely first within a kind.
void AppendRelations(std::string& page, const ReportData& data, const std::filesystem::path& result);

// Appends what became of the detector's boxes, by class, and what would help.
void AppendClasses(std::string& page, const ReportData& data);

// Appends how the run was made and how it went: camera, detector, tracking losses, submaps, gravity,
// warnings, settings that differ from the defaults, command and version.
void AppendRun(std::string& page, const ReportData& data);

// Returns an SVG element with the top view (x right, y up) of the camera path, the true path if known, and
// the objects' outlines in their colours; empty if there is nothing to show.
std::string TopViewSvg(const ReportData& data, const LabelColors& colors);

}  // namespace sqslam::app
