#include "slam/geometry/solid_iou.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace sqslam {
namespace {

using Eigen::Vector3d;

constexpr int kFirstDepth = 4;
constexpr int kLastDepth = 8;
constexpr double kRelativeTolerance = 0.002;
constexpr double kAbsoluteTolerance = 2e-5;
constexpr int kSamplesPerLeaf = 4;

// Both solids seen from the object frame of `a`, whose box is the root of the octree.
struct Pair {
  Solid a, b;
  Rigid3d T_b_a;

  double ScaleA(const Vector3d& p_a) const { return a.RadialScale(p_a); }
  double ScaleB(const Vector3d& p_a) const { return b.RadialScale(T_b_a * p_a); }
};

// Returns the largest value of b's norm over the corners of a cell with these half extents (axes of a).
double CornerReach(const Pair& pair, const Vector3d& extent) {
  double reach = 0.0;
  for (const double sy : {-1.0, 1.0}) {
    for (const double sz : {-1.0, 1.0}) {  // the other four corners are mirror images
      const Vector3d corner = extent.cwiseProduct(Vector3d(1.0, sy, sz));
      reach = std::max(reach, pair.b.RadialScale(pair.T_b_a.rotation * corner));
    }
  }
  return reach;
}

// Returns the n-th point of the additive recurrence of the plastic number (Roberts 2018) in [-1, 1]^3: evenly
// spread, no seed.
Vector3d QuasiRandomPoint(long n) {
  constexpr double kRoot = 1.2207440846057596;  // x^4 = x + 1
  const Vector3d step(1.0 / kRoot, 1.0 / (kRoot * kRoot), 1.0 / (kRoot * kRoot * kRoot));
  const Vector3d position = Vector3d::Constant(0.5) + static_cast<double>(n) * step;
  return 2.0 * (position - position.array().floor().matrix()) - Vector3d::Ones();
}

// Cells of one depth that the pruning left undecided; `inside` sums the volume that lies in both solids.
struct Level {
  std::vector<Vector3d> centers;
  Vector3d extent;       // half extents of a cell
  double reach_a = 0.0;  // of a cell, in the norms of a and b: both obey the triangle inequality, so a cell
  double reach_b = 0.0;  // whose centre is further than this from the surface lies on one side of it
  double inside = 0.0;
};

double CellVolume(const Level& level) { return 8.0 * level.extent.prod(); }

Level Subdivide(const Pair& pair, const Level& parent) {
  Level child;
  child.extent = 0.5 * parent.extent;
  child.reach_a = 0.5 * parent.reach_a;
  child.reach_b = 0.5 * parent.reach_b;
  child.inside = parent.inside;
  child.centers.reserve(4 * parent.centers.size());
  for (const Vector3d& center : parent.centers) {
    for (int octant = 0; octant < 8; ++octant) {
      const Vector3d sign(octant & 1 ? 1.0 : -1.0, octant & 2 ? 1.0 : -1.0, octant & 4 ? 1.0 : -1.0);
      const Vector3d p = center + sign.cwiseProduct(child.extent);
      const double scale_a = pair.ScaleA(p);
      if (scale_a - child.reach_a >= 1.0) {
        continue;
      }
      const double scale_b = pair.ScaleB(p);
      if (scale_b - child.reach_b >= 1.0) {
        continue;
      }
      if (scale_a + child.reach_a <= 1.0 && scale_b + child.reach_b <= 1.0) {
        child.inside += CellVolume(child);
      } else {
        child.centers.push_back(p);
      }
    }
  }
  return child;
}

// Estimates the volume of the intersection by sampling the undecided cells. One sequence runs over all cells,
// so that a face parallel to the cells is met at every offset and its errors cancel.
double EstimateIntersection(const Pair& pair, const Level& level) {
  long hits = 0;
  long n = 0;
  for (const Vector3d& center : level.centers) {
    for (int i = 0; i < kSamplesPerLeaf; ++i) {
      const Vector3d p = center + QuasiRandomPoint(++n).cwiseProduct(level.extent);
      hits += pair.ScaleA(p) <= 1.0 && pair.ScaleB(p) <= 1.0 ? 1 : 0;
    }
  }
  return level.inside + CellVolume(level) * static_cast<double>(hits) / kSamplesPerLeaf;
}

}  // namespace

Solid Solid::FromSuperquadric(const PosedSuperquadric& superquadric) {
  return {SolidKind::kSuperquadric, superquadric.shape.half_size, superquadric.shape.e1,
          superquadric.shape.e2, superquadric.T_map_object};
}

double Solid::RadialScale(const Vector3d& p_object) const {
  const Vector3d unit = p_object.cwiseQuotient(half_size).cwiseAbs();
  return kind == SolidKind::kSuperquadric ? Superquadric{half_size, e1, e2}.RadialScale(p_object)
         : kind == SolidKind::kCuboid     ? unit.maxCoeff()
         : kind == SolidKind::kCylinder   ? std::max(unit.head<2>().norm(), unit.z())
                                          : unit.norm();
}

PosedSuperquadric Solid::ToSuperquadric() const {
  Solid exact = *this;
  SetExponents(exact.kind, exact.e1, exact.e2, 0.0);
  return {{half_size, exact.e1, exact.e2}, T_map_object};
}

bool Solid::IsUsable() const {
  return half_size.allFinite() && half_size.minCoeff() > 0.0 && T_map_object.translation.allFinite();
}

bool Solid::Contains(const Vector3d& p_map) const {
  return RadialScale(T_map_object.Inverse() * p_map) <= 1.0;
}

double Solid::Volume() const {
  constexpr double kPi = std::numbers::pi;
  return kind == SolidKind::kSuperquadric ? Superquadric{half_size, e1, e2}.Volume()
         : kind == SolidKind::kCuboid     ? 8.0 * half_size.prod()
         : kind == SolidKind::kCylinder   ? 2.0 * kPi * half_size.prod()
                                          : 4.0 / 3.0 * kPi * half_size.prod();
}

Eigen::AlignedBox3d Solid::BoundingBox() const {
  const Vector3d reach = T_map_object.RotationMatrix().cwiseAbs() * half_size;
  return {T_map_object.translation - reach, T_map_object.translation + reach};
}

void SetExponents(SolidKind kind, double& e1, double& e2, double sharp) {
  if (kind != SolidKind::kSuperquadric) {
    e1 = kind == SolidKind::kEllipsoid ? 1.0 : sharp;
    e2 = kind == SolidKind::kCuboid ? sharp : 1.0;
  }
}

std::array<double, 2> UsualExponents(SolidKind primitive) {
  constexpr double kUsualEdge = 0.15;
  std::array<double, 2> exponents{};
  SetExponents(primitive, exponents[0], exponents[1], kUsualEdge);
  return exponents;
}

SolidKind NearestPrimitive(double e1, double e2) {
  return *std::ranges::min_element(kPrimitives, {}, [&](SolidKind primitive) {
    const auto [a, b] = UsualExponents(primitive);
    return std::hypot(e1 - a, e2 - b);
  });
}

void SetKind(Solid& solid, SolidKind kind) {
  solid.kind = kind;
  SetExponents(kind, solid.e1, solid.e2);
}

Solid Transform(const Sim3d& S_to_map, const Solid& solid) {
  Solid result = solid;
  result.half_size = S_to_map.scale * solid.half_size;
  result.T_map_object = S_to_map * solid.T_map_object;
  return result;
}

double IoU(const Solid& a, const Solid& b) {
  if (!a.IsUsable() || !b.IsUsable()) {
    return 0.0;
  }
  // The cells suit the proportions of the smaller solid.
  const double volume_a = a.Volume();
  const double volume_b = b.Volume();
  Pair pair = volume_a <= volume_b ? Pair{a, b, {}} : Pair{b, a, {}};
  pair.T_b_a = pair.b.T_map_object.Inverse() * pair.a.T_map_object;

  Solid b_from_a = pair.b;
  b_from_a.T_map_object = pair.T_b_a.Inverse();
  const Eigen::AlignedBox3d root =
      b_from_a.BoundingBox().intersection(Eigen::AlignedBox3d(-pair.a.half_size, pair.a.half_size));
  if (root.isEmpty() || root.sizes().minCoeff() <= 0.0) {
    return 0.0;
  }
  Level level;
  level.centers = {root.center()};
  level.extent = 0.5 * root.sizes();
  level.reach_a = pair.ScaleA(level.extent);
  level.reach_b = CornerReach(pair, level.extent);

  double iou = -1.0;
  for (int depth = 1; depth <= kLastDepth; ++depth) {
    level = Subdivide(pair, level);
    if (depth < kFirstDepth) {
      continue;
    }
    const double intersection = EstimateIntersection(pair, level);
    const double refined = std::clamp(intersection / (volume_a + volume_b - intersection), 0.0, 1.0);
    if (std::abs(refined - iou) <= std::max(kAbsoluteTolerance, kRelativeTolerance * refined)) {
      return refined;
    }
    iou = refined;
  }
  return iou;
}

}  // namespace sqslam
