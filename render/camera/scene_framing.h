#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "render/camera/camera_path.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// The part of a map that a picture should show: the objects with their surroundings (without objects, the
// bulk of the points) and the camera path. Robust to a few outlying points.
struct SceneFocus {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 1.0;  // map units
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d front = -Eigen::Vector3d::UnitY();  // horizontal, towards the cameras
  double ground_height = 0.0;                         // along `up`; place of the grid: desk or floor
  double view_depth = 1.0;                            // median distance of the keyframes from the centre
  std::vector<Eigen::Vector3d> outline;               // points that must be inside the picture
  std::optional<Eigen::Vector3d> main_direction;      // horizontal; set for orthographic pictures
};

// The parts of a map that a picture draws, and should therefore contain. They do not affect the scene's
// scale.
struct FramedParts {
  bool objects = true;
  bool uncertain_objects = true;
  bool points = true;
  bool path = true;
};

SceneFocus FindFocus(const MapSnapshot& map, const FramedParts& parts = {});

// Adds the bulk of a cloud around objects and path, without outliers, to the outline. Keeps the scene's
// scale.
void IncludeCloud(const std::vector<Eigen::Vector3d>& cloud, SceneFocus& focus);

// Returns a three-quarter view from the cameras' side that contains the outline. aspect: width / height;
// view_angle: vertical, degrees.
ViewCamera FrameScene(const SceneFocus& focus, double aspect, double view_angle = 30.0,
                      Projection projection = Projection::kPerspective);

// A part of a picture, as fractions of its width and height from the top-left corner.
using PicturePart = Eigen::AlignedBox2d;

// Returns the whole picture without a margin.
PicturePart WithinMargin(double margin);

// Moves the camera along its line of sight and sideways until the outline fills the given part of the
// picture, which must contain the picture's centre.
ViewCamera FitOutline(const ViewCamera& camera, const std::vector<Eigen::Vector3d>& outline, double aspect,
                      const PicturePart& part = WithinMargin(0.08));

// Like FitOutline, but returns the nearest view whose outline does not overlap the texts in the picture's
// corners. If there is no such view, the outline overlaps them.
ViewCamera FitBeside(const ViewCamera& camera, const std::vector<Eigen::Vector3d>& outline, double aspect,
                     std::span<const PicturePart> written);

// Returns the smallest distance, at least each view's own, at which all of the views contain the outline.
double DistanceForAll(const std::vector<ViewCamera>& views, const std::vector<Eigen::Vector3d>& outline,
                      double aspect, double margin = 0.03);

// Returns the corners of a solid's bounding box, map frame.
std::array<Eigen::Vector3d, 8> BoxCorners(const PosedSuperquadric& solid);

// Rounds down to 1, 2 or 5 times a power of ten.
double RoundLength(double length);

// Returns the cell size of the ground grid, map units.
inline double GridCell(const SceneFocus& focus) { return RoundLength(0.4 * focus.radius); }

// Return the heights of the frusta of keyframes and of the current camera, which is drawn larger; map units.
// `size`: that of the style's cameras.
inline double KeyframeFrustumHeight(const SceneFocus& focus, double size) {
  return 2.0 * size * std::min(focus.radius, focus.view_depth);
}
inline double CurrentFrustumHeight(const SceneFocus& focus, double size) {
  return 1.6 * KeyframeFrustumHeight(focus, size);
}

// Returns the names of the presets, each framed like the automatic view: front, right, back, left, top,
// isometric. Front is the mean side of the cameras, right is a viewer's right there. These look horizontally,
// top straight down with the front below, isometric from 45 degrees right and 35.26 up. An orthographic top
// view is turned: focus.main_direction lies along the longer side of the picture.
std::vector<std::string> ViewPresetNames();

// Throws UsageError that lists the names if `name` is unknown. aspect: width / height; view_angle: degrees.
ViewCamera PresetView(const std::string& name, const SceneFocus& focus, double aspect,
                      double view_angle = 30.0, Projection projection = Projection::kPerspective);

// Returns the horizontal direction of the line in which most of the points lie, seen along `up` (unit
// length): that of the longest wall of a room, or of the path in a corridor.
Eigen::Vector3d MainDirection(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& up);

// Returns MainDirection of the cloud, or, if it is empty, of the map's points and camera path around the
// focus.
Eigen::Vector3d MainDirectionOf(const MapSnapshot& map, const std::vector<Eigen::Vector3d>& cloud,
                                const SceneFocus& focus);

}  // namespace sqslam
