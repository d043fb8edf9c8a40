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

// Limits of what a page carries of a run: a file to be sent is kept small.
struct MapViewOptions {
  int image_width = 420;           // px of the keyframes' images
  int image_quality = 68;          // of their JPEG, 0 to 100
  int images = 110;                // at most so many keyframes have one
  std::size_t points = 60'000;     // at most so many map points
  std::size_t cloud = 180'000;     // and of the dense cloud
  int segments = 36;               // steps of longitude of a superquadric
  double outline_tolerance = 0.5;  // px by which outlines over images may be simpler than they are
};

// Layers over the map besides those of the recording.
struct MapViewExtras {
  std::string title;
  double metres = 0.0;  // of a unit of the recording as it is read; 0: as that says
  std::vector<std::vector<Eigen::Vector3d>> true_path;  // map frame, in pieces
};

// A finished run as the page in a browser takes it: geometry as .glb, all else as JSON, and images.
struct MapView {
  std::string glb;    // objects, points and dense cloud, the latter two in the order in which they were seen
  std::string scene;  // JSON: objects, keyframes, path, colours, the first look
  std::vector<std::string> images;  // JPEG files; keyframes name them by number
};

// Gathers the view from a recording and its history (ReadHistory), from trajectory.txt beside it, and from
// the mapped images where they are still there. Throws InputError that names the file.
MapView ReadMapView(const RecordingReader& reader, const ViewHistory& history,
                    const std::filesystem::path& recording, const MapViewExtras& extras,
                    const MapViewOptions& options = {});

// Elements of a page: the view's stage and all that it is made of, three.js with it. Nothing is loaded from
// elsewhere. Throws InputError where three.js is not installed.
std::string MapViewElements(const MapView& view);

// A page that is the view alone.
std::string MapViewPage(const MapView& view, const std::string& title);

}  // namespace sqslam::app
