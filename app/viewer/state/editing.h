#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/viewer/frames/history_reader.h"
#include "app/viewer/frames/shown_frame.h"
#include "app/viewer/model/object_points.h"
#include "app/viewer/model/point_selection.h"
#include "app/viewer/model/viewer_document.h"
#include "app/viewer/model/viewer_settings.h"

namespace sqslam::viewer {

// By what the points of the selected object are coloured.
enum class PointColors { kNone, kResidual, kAnomaly };

// The tool that draws a ground truth. Works in the frame of the finished map.
struct AnnotationTool {
  bool active = false;  // its panel is in front: the mouse in the scene is its
  bool drawn = false;   // the panel was drawn in this frame
  std::optional<int> selected;
  std::string label = "object";  // of solids to come
  bool standing = true;          // fits reach down to the ground
  bool round = true;             // cylinders have a circular section
  bool in_world = false;         // the file is in the world of the sequence's ground truth
  std::optional<Sim3d> S_world_map;
  std::string file;        // objects_gt.json
  std::string cloud_file;  // a dense cloud; empty: the map's points
  std::shared_ptr<const AnnotationCloud> cloud;
  std::optional<double> ground;  // z of the plane that things stand on, map frame
  MapSnapshotPtr prepared_for;   // the map that cloud and ground belong to

  bool lasso = false;                    // a drag draws one
  std::vector<Eigen::Vector2d> outline;  // of the lasso that is being drawn, pixels of the scene
  std::vector<int> chosen;               // points of the cloud

  std::optional<SolidHandle> hovered;
  struct Drag {
    SolidHandle handle;
    AnnotatedSolid start;
    ViewRay from;
  };
  std::optional<Drag> drag;
};

// Something that waits until unsaved changes are saved or given up.
struct Postponed {
  bool quit = false;
  std::filesystem::path open;  // otherwise
};

// What the user changes, and what the window remembers; a part of ViewerState.
struct Editing {
  ViewerDocument document;
  Representation representation = Representation::kSuperquadric;
  PointColors point_colors = PointColors::kNone;
  ShownFramePtr raw;                                // the frame on the screen without edits
  std::shared_ptr<const RecordingHistory> history;  // null until it is read
  double history_progress = 0.0;                    // [0, 1]
  AnnotationTool annotation;
  std::optional<Postponed> postponed;
  bool discard = false;  // what is unsaved was given up

  ViewerSettings settings;
  ViewerMemory memory;
  std::filesystem::path settings_file;  // empty: nothing is kept between runs
  std::filesystem::path memory_file;
  bool show_settings = false;
};

}  // namespace sqslam::viewer
