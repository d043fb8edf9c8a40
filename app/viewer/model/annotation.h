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

// One solid of a ground truth that is being annotated, in the frame of the annotation (world or map), z up.
struct AnnotatedSolid {
  int id = 0;
  std::string label;
  std::string name;  // empty: none
  Solid solid;       // primitives have the exponents of their kind (SetKind)
  std::string more;  // JSON object of its other keys in the file ("scored", ...), or empty

  bool operator==(const AnnotatedSolid&) const = default;
};

// A ground truth of objects. A value type: undo keeps copies of it (EditedDocument).
struct Annotation {
  std::vector<AnnotatedSolid> solids;
  std::string more;  // JSON object of other keys in the file ("up_world"), or empty

  bool operator==(const Annotation&) const = default;

  // Adds a copy with the next free id (from 1) and returns that id.
  int Add(AnnotatedSolid solid);
  void Remove(int id);
  const AnnotatedSolid* Find(int id) const;  // null if there is none
  // Replaces the solid with the same id. Throws UsageError if there is none, and as CheckSolid does.
  void Replace(const AnnotatedSolid& solid);
};

// Throws UsageError naming the value unless half sizes are above 0, exponents in [0.1, 1.9], all finite.
void CheckSolid(const Solid& solid);

// All kinds in the order of menus.
inline constexpr std::array<SolidKind, 4> kSolidKinds = {SolidKind::kCuboid, SolidKind::kCylinder,
                                                         SolidKind::kEllipsoid, SolidKind::kSuperquadric};

Solid UprightSolid(SolidKind kind, const Eigen::Vector3d& center, double yaw,
                   const Eigen::Vector3d& half_size);
// Returns the solid as a superquadric; the sharp edges of primitives become exponents of 0.1.
PosedSuperquadric AsSuperquadric(const Solid& solid);

// Yaw: radians about z, in (-pi, pi]. Setting it keeps a tilt of the solid.
double YawOf(const Solid& solid);
void SetYaw(Solid& solid, double yaw);

double BottomOf(const Solid& solid);  // lowest z, exact for upright solids

enum class GroundSnap {
  kMove,   // the solid keeps its size
  kExtend  // its top stays, for points that miss the lower part; moves the solid if the ground is above it
};
// Puts the bottom of an upright solid at z = ground.
void SnapToGround(Solid& solid, double ground, GroundSnap how);

// A handle to drag: the centre (moves over the ground), the six sides, and the yaw, beyond the +x side.
struct SolidHandle {
  enum class Kind { kCenter, kSide, kYaw };
  Kind kind = Kind::kCenter;
  int axis = 0;  // for sides: 0 to 2
  int sign = 1;  // for sides: +1 or -1

  bool operator==(const SolidHandle&) const = default;
};
std::array<SolidHandle, 8> SolidHandles();
Eigen::Vector3d HandlePosition(const Solid& solid, const SolidHandle& handle);

// Returns `start` after a handle was dragged from one viewing ray to another. The centre moves in its
// horizontal plane or, if that is seen edge-on, in the vertical plane that faces the camera; a side moves
// along its axis while the opposite side stays, down to 2 % of the size.
Solid DragHandle(const Solid& start, const SolidHandle& handle, const Ray& from, const Ray& to);

// A line of a solid in an image: distorted pixels in order, not closed implicitly.
struct WireLine {
  std::vector<Eigen::Vector2d> pixels;
  bool hidden = false;  // behind the solid itself: drawn faint
};

// Projects the edges of a solid into an image: of cuboids the twelve edges, of cylinders the two rims and the
// two sides of the outline, of ellipsoids and superquadrics the outline and the section through the centre.
// Parts behind the camera are clipped, parts outside the image stay. Empty if the camera is inside the solid.
std::vector<WireLine> ProjectWireframe(const Solid& solid, const Camera& camera, const Rigid3d& T_map_camera);

}  // namespace sqslam::viewer
