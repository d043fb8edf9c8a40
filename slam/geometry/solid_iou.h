#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "slam/geometry/rigid3.h"
#include "slam/geometry/superquadric.h"

namespace sqslam {

enum class SolidKind { kCuboid, kCylinder, kEllipsoid, kSuperquadric };
constexpr auto EnumNames(SolidKind) { return std::array{"cuboid", "cylinder", "ellipsoid", "superquadric"}; }
inline constexpr std::array kPrimitives = {SolidKind::kCuboid, SolidKind::kCylinder, SolidKind::kEllipsoid};

// A convex solid in the map, symmetric about its own three planes: a superquadric, or a sharp-edged primitive
// of a ground truth. A cylinder has its axis along z and an elliptic cross-section.
struct Solid {
  SolidKind kind = SolidKind::kCuboid;
  Eigen::Vector3d half_size = Eigen::Vector3d::Ones();  // map units, > 0
  double e1 = 1.0;                                      // of superquadrics only
  double e2 = 1.0;
  Rigid3d T_map_object;

  static Solid FromSuperquadric(const PosedSuperquadric& superquadric);
  PosedSuperquadric ToSuperquadric() const;  // of the same surface; the exponents of sharp edges are 0

  bool operator==(const Solid&) const = default;

  bool IsUsable() const;  // sizes positive, all numbers finite

  // Norm of a point of the object frame whose unit ball is the solid: < 1 inside, 1 on the surface, > 1
  // outside.
  double RadialScale(const Eigen::Vector3d& p_object) const;
  bool Contains(const Eigen::Vector3d& p_map) const;
  double Volume() const;                    // closed form
  Eigen::AlignedBox3d BoundingBox() const;  // in the map frame; tight for cuboids, enclosing for the others
};

// Sets the exponents that a kind has in objects_gt.json: cuboid 0.1, 0.1; cylinder 0.1, 1; ellipsoid 1, 1;
// superquadrics keep theirs. `sharp` is the exponent of an edge.
void SetExponents(SolidKind kind, double& e1, double& e2, double sharp = kMinShapeExponent);

// Returns the exponents e1, e2 of a primitive whose edges are slightly rounded, as those of most things.
std::array<double, 2> UsualExponents(SolidKind primitive);

// Returns the primitive whose usual exponents are nearest.
SolidKind NearestPrimitive(double e1, double e2);

// Changes the kind of a solid, with its exponents.
void SetKind(Solid& solid, SolidKind kind);

// The same solid after p_to = S_to_map * p_map.
Solid Transform(const Sim3d& S_to_map, const Solid& solid);

// Returns the 3D intersection over union in [0, 1]: the intersection by an octree that both inside-outside
// functions prune exactly, sampled quasi-randomly in undecided leaves, refined until two successive depths
// agree to 0.2 % of the result (0.002 % absolute near 0); the union from the closed-form volumes.
// Deterministic. 0 if a size is not positive and finite.
double IoU(const Solid& a, const Solid& b);

}  // namespace sqslam
