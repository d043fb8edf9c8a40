#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <set>
#include <string>
#include <vector>

#include "render/scene/style.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::app {

// Facts about a run that its recorded states contain but the finished map does not.
struct ViewHistory {
  std::map<std::int32_t, double> first_seen;  // object id -> time of the first state that holds it, seconds
  std::map<std::int64_t, std::set<std::int32_t>> seen_in;  // frame -> ids of objects with a box in it
  std::map<std::int64_t, std::string> image_files;         // frame -> image file, if it had one
};

// The outline of an object over the image of a keyframe.
struct SeenOutline {
  std::size_t keyframe = 0;  // indices of keyframe and object in the map
  std::size_t object = 0;
  bool detected = false;           // the object has a box in this keyframe
  double share = 0.0;              // share of the image that it covers
  bool whole = false;              // entirely inside the image
  std::vector<cv::Point> polygon;  // px, with lens distortion
};

// Returns the outlines of all objects in all keyframes, nearest object first within a keyframe. They are
// simplified with an error of at most `tolerance` px.
std::vector<SeenOutline> FindOutlines(const MapSnapshot& map, const ViewHistory& history, double tolerance);

// Reads every state of the recording. Slow: call it once and reuse the result.
ViewHistory ReadHistory(const RecordingReader& reader);

// Returns, for each point, the index of the first keyframe that has it in view, no farther than 2.5 times the
// median depth of that view; the last keyframe if there is none.
std::vector<std::size_t> FirstViews(const MapSnapshot& map, const std::vector<Eigen::Vector3f>& points);

// Limits on the content of a page, which keep the file small enough to send.
struct MapViewOptions {
  int image_width = 420;           // px of the keyframes' images
  int image_quality = 68;          // JPEG quality, 0 to 100
  int images = 110;                // keyframes with an image, at most
  std::size_t points = 60'000;     // map points, at most
  std::size_t cloud = 400'000;     // points of the dense cloud, at most
  int segments = 36;               // steps of longitude of each superquadric
  double outline_tolerance = 0.5;  // px; maximum error of the simplified outlines over images
};

// Additional content that the recording does not hold.
struct MapViewExtras {
  std::string title{};
  double metres = 0.0;  // per unit of the recording as read; 0: as the recording says
  std::vector<std::vector<Eigen::Vector3d>> true_path;  // map frame, split at gaps
  std::shared_ptr<const MapTruth> truth{};              // may be null
  SceneStyle style{};                                   // colours of classes, size of the frusta
  std::vector<std::string> render_options{};  // that `sqslam render` needs for the same map, beside its view
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

// Returns a page with the view of a recording only, titled by the name of its sequence.
std::string MapViewPage(const RecordingReader& reader, const std::filesystem::path& recording,
                        const MapViewExtras& extras = {});

}  // namespace sqslam::app
