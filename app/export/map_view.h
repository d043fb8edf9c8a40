#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "app/export/view_history.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::app {

// Limits on what a page contains of a run, so that the file stays small enough to send.
struct MapViewOptions {
  int image_width = 420;           // px of the keyframes' images
  int image_quality = 68;          // JPEG quality, 0 to 100
  int images = 110;                // most keyframes that get an image
  std::size_t points = 60'000;     // most map points
  std::size_t cloud = 180'000;     // most points of the dense cloud
  int segments = 36;               // steps of longitude of each superquadric
  double outline_tolerance = 0.5;  // px; greatest error of the simplified outlines over images
};

// Additional content that the recording does not hold.
struct MapViewExtras {
  std::string title;
  double metres = 0.0;  // per unit of the recording as read; 0: as the recording says
  std::vector<std::vector<Eigen::Vector3d>> true_path;  // map frame, split at gaps
};

// A finished run in the form that the page reads: geometry as .glb, everything else as JSON, and images.
struct MapView {
  std::string glb;    // objects; points and dense cloud in the order in which they were first seen
  std::string scene;  // JSON: objects, keyframes, path, colours, initial view
  std::vector<std::string> images;  // JPEG files; keyframes refer to them by index
};

// Builds the view from a recording, its history (ReadHistory), trajectory.txt beside it, and the mapped
// images if they still exist. Throws InputError that names the file.
MapView ReadMapView(const RecordingReader& reader, const ViewHistory& history,
                    const std::filesystem::path& recording, const MapViewExtras& extras,
                    const MapViewOptions& options = {});

// Returns the HTML elements of the view with all its data and three.js embedded: the page loads nothing else.
// Throws InputError if three.js is not installed.
std::string MapViewElements(const MapView& view);

// Returns a whole page for a body, with the style sheets assets/theme.css and, if not empty, `style`.
// `classes`: of the page's element.
std::string HtmlPage(const std::string& title, const std::string& body, const std::string& style = "",
                     const std::string& classes = "");

// Returns a page with nothing but the view.
std::string MapViewPage(const MapView& view, const std::string& title);

}  // namespace sqslam::app
