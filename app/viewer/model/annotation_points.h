#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/solid_iou.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::viewer {

// Points to annotate on: of a map, or of a dense cloud in a PLY or text file (slam/io/point_cloud.h),
// transformed to the frame of the annotation. Selections are indices into them. Reading throws InputError.
using Points = std::vector<Eigen::Vector3d>;
Points ReadPoints(const std::filesystem::path& path, const Sim3d& S_annotation_file = {});

// An oriented box.
struct SelectionBox {
  Rigid3d T_map_box;
  Eigen::Vector3d half_size = Eigen::Vector3d::Ones();
};

// Returns the indices of the points inside, ascending.
std::vector<int> SelectInBox(std::span<const Eigen::Vector3d> points, const SelectionBox& box);

// Returns the points in front of the camera that project into a polygon (distorted pixels), at any depth.
std::vector<int> SelectInLasso(std::span<const Eigen::Vector3d> points,
                               std::span<const Eigen::Vector2d> polygon, const Camera& camera,
                               const Rigid3d& T_map_camera);

// Returns the chosen points more than `margin` above z = ground, for example an object without its table.
std::vector<int> AboveGround(std::span<const Eigen::Vector3d> points, std::span<const int> chosen,
                             double ground, double margin);

// Replaces a selection, adds to it (Shift) or removes from it (Ctrl).
enum class SelectMode { kReplace, kAdd, kRemove };
std::vector<int> Combine(std::span<const int> old, std::span<const int> chosen, SelectMode mode);

// Returns z of the ground, the largest horizontal plane (a desk or the floor): the map's support plane if it
// has one, else one found in the points; empty if there is none.
std::optional<double> GroundHeight(const MapSnapshot& map);
std::optional<double> GroundHeight(std::span<const Eigen::Vector3d> points);

Points PointsAt(std::span<const Eigen::Vector3d> points, std::span<const int> chosen);

struct PrimitiveFitOptions {
  bool round = true;             // cylinders get a circular cross-section
  std::optional<double> ground;  // z to extend the solid down to (its top stays); empty: as fitted
};

struct PrimitiveFit {
  Solid solid;       // upright, in the frame and unit of the points
  double rms = 0.0;  // RMS distance of the points to the surface
  int points = 0;
};

// Fits an upright solid of a kind to points of its surface, even if they show only some of its sides: unseen
// sides reach as far as the points (or to the ground). Needs 6 points, superquadrics 11. Yaw in (-45, 45]
// degrees, x and y axes named accordingly. Throws InputError for fewer points, or if all points coincide.
PrimitiveFit FitPrimitive(std::span<const Eigen::Vector3d> points, SolidKind kind,
                          const PrimitiveFitOptions& options = {});

}  // namespace sqslam::viewer
