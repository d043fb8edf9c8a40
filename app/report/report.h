#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/export/view_history.h"
#include "render/scene/style.h"
#include "slam/evaluation/evaluation.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/run/run_host.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::app {

struct ReportInputs {
  std::filesystem::path result;  // result folder; report.html is written into it
  std::string title;             // empty: the name of the sequence, or of the result folder
  std::string sequence;          // what was mapped, as shown under the title; empty: as the recording says
  std::filesystem::path video;   // embedded up to 3 MiB; empty: growth.mp4 or map.mp4 if there
  const FinishedRun* run = nullptr;  // the run that was just made: its values instead of its files
  const Evaluation* evaluation = nullptr;
};

// The values that a page shows; what is empty or absent leaves its section out.
struct ReportData {
  Trajectory trajectory;
  std::vector<SnapshotObject> objects;
  std::optional<RunStats> stats;
  const Evaluation* evaluation = nullptr;
  std::shared_ptr<const RecordingReader> recording;  // null where there is none

  std::optional<MapScale> scale;  // empty: lengths are map units

  bool IsMetric() const { return scale || evaluation != nullptr; }
  double Scale() const {  // metres per length of the files: what somebody measured goes before the true poses
    return !scale && evaluation != nullptr ? evaluation->trajectory.S_world_map.scale : 1.0;
  }
  std::string Unit() const { return IsMetric() ? "m" : "map units"; }
};

// One self-contained page: figures of the run, an input image with outlines, the map to be turned, a top view
// of trajectory and objects, tables, figures/*.png, how the run was made; all embedded, and what is missing
// is left out. Throws InputError where a file is broken or the page cannot be written.
void WriteReport(const ReportInputs& inputs);

// Parts of the page.

// "data:image/png;base64,..." of a file. Throws InputError where it cannot be read.
std::string DataUri(const std::filesystem::path& file, std::string_view mime_type);

// The same of a picture as people look at it: in whatever format is smallest.
std::string PictureUri(const cv::Mat& picture);
std::string PictureUri(const std::filesystem::path& file);

// The input image that shows most reliable objects, with their outlines and names.
struct OutlinedPhoto {
  cv::Mat picture;
  std::string caption;
};
std::optional<OutlinedPhoto> BestPhoto(const RecordingReader& reader, const ViewHistory& history);

// Tables, each a section: of the objects, of the objects held against the ground truth, of times.
void AppendObjects(std::string& page, const ReportData& data, const LabelColors& colors);
void AppendComparison(std::string& page, const ReportData& data, const LabelColors& colors);
void AppendTiming(std::string& page, const ReportData& data);

// Adds how the run was made and how it went: camera, detector, losses, submaps, gravity, warnings, settings
// that differ from the defaults, command and version.
void AppendRun(std::string& page, const ReportData& data);

// The whole page around its body, with the style sheet.
std::string HtmlPage(const std::string& title, const std::string& body);

// Top view (x to the right, y up, seen against gravity) of the camera path, the ground truth's path where
// there is one, and the outlines of the objects in their colours: an SVG element, empty where there is
// nothing to show.
std::string TopViewSvg(const ReportData& data, const LabelColors& colors);

// Cross-section and side view of one object as two small outlines.
std::string ShapeGlyphSvg(const SnapshotObject& object, const Eigen::Vector3d& color);

}  // namespace sqslam::app
