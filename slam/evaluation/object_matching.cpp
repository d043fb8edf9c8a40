#include "slam/evaluation/object_matching.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "slam/geometry/nearest_solid.h"
#include "slam/io/coco.h"
#include "slam/objects/assignment.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// Returns the mapped half sizes in the order of the ground truth's axes: a box rotated by 90 degrees with x
// and y swapped is the same box.
Eigen::Vector3d PairedHalfSize(const Solid& mapped, const Solid& truth) {
  const Eigen::Matrix3d alignment = (truth.T_map_object.rotation.conjugate() * mapped.T_map_object.rotation)
                                        .toRotationMatrix()
                                        .cwiseAbs();  // rows: true axes, columns: mapped axes
  std::array<int, 3> order = {0, 1, 2};
  std::array<int, 3> best = order;
  double best_score = -1.0;
  do {
    const double score = alignment(0, order[0]) + alignment(1, order[1]) + alignment(2, order[2]);
    if (score > best_score) {
      best_score = score;
      best = order;
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return {mapped.half_size[best[0]], mapped.half_size[best[1]], mapped.half_size[best[2]]};
}

bool HasRoundSection(const Solid& solid) {
  const bool elliptic = solid.kind == SolidKind::kCylinder || solid.kind == SolidKind::kEllipsoid ||
                        (solid.kind == SolidKind::kSuperquadric && std::abs(solid.e2 - 1.0) < 0.2);
  return elliptic && std::abs(solid.half_size.x() - solid.half_size.y()) < 0.1 * solid.half_size.x();
}

ObjectMatch MatchBetween(const Solid& mapped, const Solid& truth) {
  ObjectMatch match;
  match.iou = IoU(mapped, truth);
  match.iou_ellipsoid =
      IoU(Solid::FromSuperquadric(NearestOfKind(SolidKind::kEllipsoid, mapped.ToSuperquadric())), truth);
  match.center_error = (mapped.T_map_object.translation - truth.T_map_object.translation).norm();
  match.size_error = 2.0 * (PairedHalfSize(mapped, truth) - truth.half_size).cwiseAbs().mean();
  const Eigen::Matrix3d relative =
      (truth.T_map_object.rotation.conjugate() * mapped.T_map_object.rotation).toRotationMatrix();
  match.tilt_error = std::acos(std::clamp(std::abs(relative(2, 2)), 0.0, 1.0));
  if (!HasRoundSection(truth)) {
    constexpr double kQuarter = 0.5 * std::numbers::pi;
    match.yaw_error = std::abs(std::remainder(std::atan2(relative(1, 0), relative(0, 0)), kQuarter));
  }
  match.footprint_iou = FootprintIoU(mapped, truth, truth.T_map_object.rotation * Eigen::Vector3d::UnitZ());
  return match;
}

bool HaveSameLabel(const SnapshotObject& mapped, const GroundTruthObject& truth) {
  return NormalizedLabel(mapped.label) == NormalizedLabel(truth.label);
}

// Returns the score of a mapped object as a true one: above 0 if it may match.
double Affinity(const Solid& mapped, const Solid& truth, bool same_label, double min_iou) {
  constexpr double kSameLabel = 0.5;
  constexpr double kMaxCenterDistance = 0.5;  // over half the space diagonal of the truth
  constexpr double kMaxSizeRatio = 3.0;       // of the space diagonals, either way
  constexpr double kMinPartInside = 0.75;     // share of a part's volume in the truth
  const double half_diagonal = truth.half_size.norm();
  const double distance = (mapped.T_map_object.translation - truth.T_map_object.translation).norm();
  const double size_ratio = mapped.half_size.norm() / half_diagonal;
  const double nearness = 1.0 - distance / (kMaxCenterDistance * half_diagonal);
  const bool size_fits = size_ratio <= kMaxSizeRatio && size_ratio >= 1.0 / kMaxSizeRatio;
  const double iou = IoU(mapped, truth);
  const bool is_near = size_fits && nearness > 0.0;
  const bool is_part = size_fits && same_label && ShareInside(mapped, truth, iou) >= kMinPartInside;
  const double label = same_label ? kSameLabel : 0.0;
  return is_near || is_part || iou >= min_iou ? iou + std::max(0.0, nearness) + label : 0.0;
}

using Eigen::Vector2d;
using Eigen::Vector3d;
using Polygon = std::vector<Vector2d>;  // convex, counterclockwise

constexpr int kOutlinePoints = 360;

// Most support points of a sharp-edged solid are the same corner up to rounding, and an edge between two of
// them has no meaningful direction.
constexpr double kMinEdgeShare = 1e-6;  // share of the solid's largest half size

Polygon Outline(const Solid& solid, const Vector3d& u, const Vector3d& v) {
  Polygon polygon;
  polygon.reserve(kOutlinePoints);
  const double shortest = kMinEdgeShare * solid.half_size.maxCoeff();
  const PosedSuperquadric superquadric = solid.ToSuperquadric();
  for (int i = 0; i < kOutlinePoints; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kOutlinePoints;
    const Vector3d direction = std::cos(angle) * u + std::sin(angle) * v;
    const Vector3d p = SupportPoint(superquadric, direction);
    const Vector2d corner(u.dot(p), v.dot(p));
    if (polygon.empty() || (corner - polygon.back()).norm() > shortest) {
      polygon.push_back(corner);
    }
  }
  while (polygon.size() > 1 && (polygon.front() - polygon.back()).norm() <= shortest) {
    polygon.pop_back();
  }
  return polygon;
}

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double Area(const Polygon& polygon) {
  double twice = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& origin = polygon.front();  // keeps the terms small
    twice += Cross(polygon[i] - origin, polygon[(i + 1) % polygon.size()] - origin);
  }
  return 0.5 * twice;
}

// Clips `polygon` to the left of the line from a to b (Sutherland and Hodgman 1974).
Polygon Clip(const Polygon& polygon, const Vector2d& a, const Vector2d& b) {
  Polygon kept;
  kept.reserve(polygon.size() + 1);
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& p = polygon[i];
    const Vector2d& q = polygon[(i + 1) % polygon.size()];
    const double side_p = Cross(b - a, p - a);
    const double side_q = Cross(b - a, q - a);
    if (side_p >= 0.0) {
      kept.push_back(p);
    }
    if ((side_p > 0.0 && side_q < 0.0) || (side_p < 0.0 && side_q > 0.0)) {
      kept.push_back(p + (q - p) * (side_p / (side_p - side_q)));
    }
  }
  return kept;
}

}  // namespace

double ShareInside(const Solid& mapped, const Solid& truth, double iou) {
  const double volume = mapped.Volume();
  const double common = iou / (1.0 + iou) * (volume + truth.Volume());
  return volume > 0.0 ? std::min(1.0, common / volume) : 0.0;
}

bool IsThin(const Solid& solid) {
  constexpr double kThinHalfSize = 0.015;  // metres
  constexpr double kThinShare = 0.05;
  const double thinnest = solid.half_size.minCoeff();
  return thinnest < kThinHalfSize || thinnest < kThinShare * solid.half_size.maxCoeff();
}

ObjectMatching MatchObjects(const std::vector<SnapshotObject>& mapped,
                            const std::vector<GroundTruthObject>& truth, const Sim3d& S_world_map,
                            double min_iou) {
  const int rows = static_cast<int>(truth.size());
  const int columns = static_cast<int>(mapped.size());
  const std::vector<Solid> solids = ToVector(mapped, [&](const SnapshotObject& object) {
    return Transform(S_world_map, Solid::FromSuperquadric(object.superquadric));
  });
  Eigen::MatrixXd affinity = Eigen::MatrixXd::Zero(rows, columns);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      affinity(i, j) = Affinity(
          solids[static_cast<std::size_t>(j)], truth[static_cast<std::size_t>(i)].solid,
          HaveSameLabel(mapped[static_cast<std::size_t>(j)], truth[static_cast<std::size_t>(i)]), min_iou);
    }
  }
  const std::vector<int> assigned = AssignOptimally(affinity);

  ObjectMatching result;
  std::vector<bool> used(mapped.size(), false);
  for (int i = 0; i < rows; ++i) {
    const int j = assigned[static_cast<std::size_t>(i)];
    if (j < 0) {
      result.missed.push_back(i);
      continue;
    }
    const auto& object = truth[static_cast<std::size_t>(i)];
    used[static_cast<std::size_t>(j)] = true;
    ObjectMatch match = MatchBetween(solids[static_cast<std::size_t>(j)], object.solid);
    match.truth = i;
    match.mapped = j;
    match.label_agrees = HaveSameLabel(mapped[static_cast<std::size_t>(j)], object);
    result.matches.push_back(match);
  }
  for (int j = 0; j < columns; ++j) {
    if (used[static_cast<std::size_t>(j)]) {
      continue;
    }
    // The assignment is optimal, so the truth that this object overlaps is matched: otherwise this object
    // would have been assigned to it.
    Eigen::Index nearest = -1;
    const double best = rows > 0 ? affinity.col(j).maxCoeff(&nearest) : 0.0;
    if (best > 0.0) {
      result.duplicates.push_back({j, static_cast<int>(nearest)});
    } else {
      result.extra.push_back(j);
    }
  }
  return result;
}

double FootprintIoU(const Solid& a, const Solid& b, const Vector3d& up) {
  if (!a.IsUsable() || !b.IsUsable()) {
    return 0.0;
  }
  const Vector3d u = up.unitOrthogonal();
  const Vector3d v = up.cross(u);
  const Polygon outline_a = Outline(a, u, v);
  const Polygon outline_b = Outline(b, u, v);
  Polygon common = outline_a;
  for (std::size_t i = 0; i < outline_b.size() && !common.empty(); ++i) {
    common = Clip(common, outline_b[i], outline_b[(i + 1) % outline_b.size()]);
  }
  const double intersection = common.size() < 3 ? 0.0 : Area(common);
  const double together = Area(outline_a) + Area(outline_b) - intersection;
  return together > 0.0 ? std::clamp(intersection / together, 0.0, 1.0) : 0.0;
}

}  // namespace sqslam
