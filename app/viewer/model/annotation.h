#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/ray.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/solid_iou.h"
#include "slam/util/enum_names.h"

namespace sqslam::viewer {

// One solid of a ground truth that is being made. The frame is that of the annotation (world or map), z up.
struct AnnotatedSolid {
  int id = 0;
  std::string label;
  std::string name;  // empty: none
  Solid solid;       // exponents of primitives are those that their names stand for (SetKind)
  std::string more;  // a JSON object with what else the file said of it ("scored", ...), or empty

  bool operator==(const AnnotatedSolid& other) const;
};

// A ground truth of objects. A value; undo keeps copies of it (EditedDocument).
struct Annotation {
  std::vector<AnnotatedSolid> solids;
  std::string more;  // a JSON object with what else the file said ("up_world"), or empty

  bool operator==(const Annotation&) const = default;

  // Adds a copy under the next free id, from 1, and returns that.
  int Add(AnnotatedSolid solid);
  void Remove(int id);
  const AnnotatedSolid* Find(int id) const;  // null where there is none
  // Replaces the one with its id. Throws UsageError where there is none, and on sizes or exponents that are
  // none (CheckSolid).
  void Replace(const AnnotatedSolid& solid);
};

// Throws UsageError that names the value: half sizes above 0, exponents in [0.1, 1.9], all finite.
void CheckSolid(const Solid& solid);

// All kinds in the order of menus.
inline constexpr std::array<SolidKind, 4> kSolidKinds = {SolidKind::kCuboid, SolidKind::kCylinder,
                                                         SolidKind::kEllipsoid, SolidKind::kSuperquadric};

Solid UprightSolid(SolidKind kind, const Eigen::Vector3d& center, double yaw,
                   const Eigen::Vector3d& half_size);
// A solid as a superquadric, edges of primitives rounded to exponents of 0.1.
PosedSuperquadric AsSuperquadric(const Solid& solid);

// Radians about z, in (-pi, pi]. Setting it keeps a lean that the solid may have.
double YawOf(const Solid& solid);
void SetYaw(Solid& solid, double yaw);

double BottomOf(const Solid& solid);  // least z, exact for upright solids

enum class GroundSnap {
  kMove,   // the solid keeps its size
  kExtend  // its top stays where it is, as where points show no lower part; moves where the ground is above
};
// Puts the bottom of an upright solid at z = ground.
void SnapToGround(Solid& solid, double ground, GroundSnap how);

// A part that can be dragged: the middle (over the ground), the six sides, and the turn, whose handle lies
// beyond the +x side.
struct SolidHandle {
  enum class Kind { kCenter, kSide, kYaw };
  Kind kind = Kind::kCenter;
  int axis = 0;  // of sides: 0 to 2
  int sign = 1;  // of sides: +1 or -1

  bool operator==(const SolidHandle&) const = default;
};
std::array<SolidHandle, 8> SolidHandles();
Eigen::Vector3d HandlePosition(const Solid& solid, const SolidHandle& handle);

// Returns `start` as it is after a handle was dragged from one line of sight to another. The middle moves in
// its horizontal plane, or, where that is seen edge-on, up and down; sides move along their axis while the
// opposite side stays, to 2 % of the size at the least.
Solid DragHandle(const Solid& start, const SolidHandle& handle, const Ray& from, const Ray& to);

// A line of a solid as an image shows it: pixels with the lens's distortion, in order, not closed by itself.
struct WireLine {
  std::vector<Eigen::Vector2d> pixels;
  bool hidden = false;  // behind the solid itself: drawn faint
};

// The edges of a solid in an image, to be held against the photograph: of cuboids the twelve edges, of
// cylinders the two rims and the two sides of the outline, of ellipsoids and superquadrics the outline and
// the section through the middle. Parts behind the camera are cut off; parts beside the picture stay. Empty
// where the camera is inside of the solid.
std::vector<WireLine> ProjectWireframe(const Solid& solid, const Camera& camera, const Rigid3d& T_map_camera);

}  // namespace sqslam::viewer
