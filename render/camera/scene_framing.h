#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "render/camera/camera_path.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// The part of a map that a picture should show: the objects and their surroundings, or the bulk of the points
// where there are no objects, and the path of the camera. A few stray points, however far away, change
// nothing.
struct SceneFocus {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 1.0;  // map units
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d front = -Eigen::Vector3d::UnitY();  // level, towards where the cameras stood
  double ground_height = 0.0;                         // along up: where to draw the grid
  double view_depth = 1.0;                            // median distance from the keyframes to the centre
  std::vector<Eigen::Vector3d> outline;               // points that must be inside the picture
};

SceneFocus FindFocus(const MapSnapshot& map);

// Takes the bulk of a cloud into the outline: what lies about the objects and the path, without stray points.
// The scale of the scene stays.
void IncludeCloud(const std::vector<Eigen::Vector3d>& cloud, SceneFocus& focus);

// A three-quarter view from the side of the cameras that holds the outline; aspect is width / height,
// view_angle is vertical, in degrees.
ViewCamera FrameScene(const SceneFocus& focus, double aspect, double view_angle = 30.0);

// A part of a picture in shares of its width and height, from the top-left corner.
using PicturePart = Eigen::AlignedBox2d;

// All of it but a margin.
PicturePart WithinMargin(double margin);

// Moves the camera along its line of sight, and sideways, until the outline fills that part of the picture,
// which must hold its middle.
ViewCamera FitOutline(const ViewCamera& camera, const std::vector<Eigen::Vector3d>& outline, double aspect,
                      const PicturePart& part = WithinMargin(0.08));

// The nearest of such views in which the outline keeps clear of what is written into corners of the picture,
// beside or below it. What leaves no room is written over.
ViewCamera FitBeside(const ViewCamera& camera, const std::vector<Eigen::Vector3d>& outline, double aspect,
                     std::span<const PicturePart> written);

// The distance from their focal points at which all of the views hold the outline; not less than they have.
double DistanceForAll(const std::vector<ViewCamera>& views, const std::vector<Eigen::Vector3d>& outline,
                      double aspect, double margin = 0.03);

// Corners of the box around a solid, map frame.
std::array<Eigen::Vector3d, 8> BoxCorners(const PosedSuperquadric& solid);

// 1, 2 or 5 times a power of ten, at most `length`.
double RoundLength(double length);

// The side of a cell of the grid below a scene, map units.
inline double GridCell(const SceneFocus& focus) { return RoundLength(0.4 * focus.radius); }

// Named views, each framed like the automatic one: front, right, back, left, top, isometric. The front is
// where the cameras stood on average; right is to the right of somebody who stands there. They look level,
// top straight down with the front below; isometric from 45 degrees to the right and 35.26 up, in
// perspective.
std::vector<std::string> ViewPresetNames();

// Throws UsageError, which lists the names, for another one. aspect: width / height; view_angle: degrees.
ViewCamera PresetView(const std::string& name, const SceneFocus& focus, double aspect,
                      double view_angle = 30.0);

}  // namespace sqslam
