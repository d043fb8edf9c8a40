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

// Points to annotate on: those of a map, or a dense cloud of a PLY or text file (slam/io/point_cloud.h),
// moved from its frame into the annotation's. Selections are indices into them. Reading throws InputError.
using Points = std::vector<Eigen::Vector3d>;
Points PointsOf(const MapSnapshot& map);
Points ReadPoints(const std::filesystem::path& path, const Sim3d& S_annotation_file = {});

// A box in any orientation.
struct SelectionBox {
  Rigid3d T_map_box;
  Eigen::Vector3d half_size = Eigen::Vector3d::Ones();
};

// Indices of the points inside, ascending.
std::vector<int> SelectInBox(std::span<const Eigen::Vector3d> points, const SelectionBox& box);

// True if a closed polygon holds the pixel; even-odd where it crosses itself.
bool Inside(std::span<const Eigen::Vector2d> polygon, const Eigen::Vector2d& pixel);

// The points that the camera sees inside of a polygon (distorted pixels), however far away.
std::vector<int> SelectInLasso(std::span<const Eigen::Vector3d> points,
                               std::span<const Eigen::Vector2d> polygon, const Camera& camera,
                               const Rigid3d& T_map_camera);

// The chosen points that are more than `margin` above z = ground: a thing without its table.
std::vector<int> AboveGround(std::span<const Eigen::Vector3d> points, std::span<const int> chosen,
                             double ground, double margin);

// Replaces a selection, adds to it (Shift) or takes away from it (Ctrl).
enum class SelectMode { kReplace, kAdd, kRemove };
std::vector<int> Combine(std::span<const int> old, std::span<const int> chosen, SelectMode mode);

// Returns z of the largest horizontal plane, a desk or the floor: the map's support where it knows one, else
// found among the points. Empty where there is none.
std::optional<double> GroundHeight(const MapSnapshot& map);
std::optional<double> GroundHeight(std::span<const Eigen::Vector3d> points);

Points PointsAt(std::span<const Eigen::Vector3d> points, std::span<const int> chosen);

struct PrimitiveFitOptions {
  bool round = true;             // cylinders get a circular cross-section
  std::optional<double> ground;  // z that the solid stands on, its top left where it is; empty: as it fits
};

struct PrimitiveFit {
  Solid solid;       // upright: only yaw is free; frame and unit of the points
  double rms = 0.0;  // distance of the points to the surface
  int points = 0;
};

// The upright solid of a kind that suits points of its surface best, even where they show only some of its
// sides: what is not seen reaches as far as the points do (or to the ground). Cuboids, cylinders and
// ellipsoids from 6 points on, superquadrics from 11. Yaw in (-45, 45] degrees, x and y axes named
// accordingly. Throws InputError for fewer points, or points that are all in one place.
PrimitiveFit FitPrimitive(std::span<const Eigen::Vector3d> points, SolidKind kind,
                          const PrimitiveFitOptions& options = {});

}  // namespace sqslam::viewer
