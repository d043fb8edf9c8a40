#include "slam/evaluation/known_surfaces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "slam/geometry/span_in_box.h"

namespace sqslam {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

// Returns where the ray enters the solid, in lengths of the ray.
double HitSolid(const Solid& solid, const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
  constexpr int kSteps = 64;
  const Rigid3d T_object_world = solid.T_map_object.Inverse();
  const Eigen::Vector3d start = T_object_world * origin;
  const Eigen::Vector3d way = T_object_world.rotation * ray;
  const Eigen::Vector3d low = -solid.half_size;
  const auto span = SpanInBox(start, way, low, solid.half_size, kFar);
  if (!span) {
    return kFar;
  }
  const auto [enter, leave] = *span;
  for (int step = 0; step <= kSteps; ++step) {
    const double along = enter + (leave - enter) * step / kSteps;
    if (solid.kind == SolidKind::kCuboid || solid.RadialScale(start + along * way) <= 1.0) {
      return along;
    }
  }
  return kFar;
}

// Returns the distance from the surface, negative inside.
double DistanceTo(const Solid& solid, const Eigen::Vector3d& p_world) {
  const Eigen::Vector3d p = solid.T_map_object.Inverse() * p_world;
  if (solid.kind != SolidKind::kCuboid) {
    return p.norm() * (1.0 - 1.0 / solid.RadialScale(p));
  }
  const Eigen::Vector3d beyond = p.cwiseAbs() - solid.half_size;
  return beyond.maxCoeff() < 0.0 ? beyond.maxCoeff() : beyond.cwiseMax(0.0).norm();
}

}  // namespace

KnownSurfaces::KnownSurfaces(const std::vector<GroundTruthObject>& objects, double min_hull_fill)
    : objects_(objects), min_hull_fill_(min_hull_fill) {
  if (objects.empty()) {
    return;
  }
  up_ = objects.front().solid.T_map_object.rotation * Eigen::Vector3d::UnitZ();
  along_ = up_.unitOrthogonal();
  across_ = up_.cross(along_);
  for (const GroundTruthObject& object : objects) {
    AddFootprint(object.solid);
  }
  for (StandPlane& plane : planes_) {
    cv::convexHull(plane.footprints, plane.hull);
  }
}

std::optional<KnownSurfaces::Miss> KnownSurfaces::MissOf(const Eigen::Vector3d& origin,
                                                         const Eigen::Vector3d& ray,
                                                         const Eigen::Vector3d& p_world) const {
  double nearest = kFar;
  const GroundTruthObject* hit = nullptr;
  for (const GroundTruthObject& object : objects_) {
    if (const double along = HitSolid(object.solid, origin, ray); along < nearest) {
      nearest = along;
      hit = &object;
    }
  }
  const StandPlane* on = nullptr;
  for (const StandPlane& plane : planes_) {
    const double along = (plane.height - up_.dot(origin)) / up_.dot(ray);
    if (along > 0.0 && along < nearest && Within(plane, origin + along * ray)) {
      nearest = along;
      on = &plane;
    }
  }
  if (on != nullptr) {
    return Miss{DistanceToPlanes(on->height, up_.dot(p_world)), nullptr};
  }
  if (hit == nullptr || hit->hull_fill < min_hull_fill_) {
    return std::nullopt;
  }
  return Miss{DistanceTo(hit->solid, p_world), hit};
}

std::vector<Eigen::Vector3d> KnownSurfaces::OnTable(const std::vector<Eigen::Vector3d>& cloud) const {
  constexpr double kThick = 0.03;   // metres, above and below
  constexpr double kMargin = 0.02;  // around objects on it, and along its border
  const std::optional<StandPlane> table = Table();
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& p : cloud) {
    if (table && std::abs(up_.dot(p) - table->height) <= kThick && Within(*table, p, kMargin) &&
        std::ranges::none_of(objects_, [&](const GroundTruthObject& object) {
          return StandsOver(object.solid, *table, p, kMargin);
        })) {
      points.push_back(p);
    }
  }
  return points;
}

cv::Point2f KnownSurfaces::OnPlane(const Eigen::Vector3d& p) const {
  return {static_cast<float>(along_.dot(p)), static_cast<float>(across_.dot(p))};
}

bool KnownSurfaces::Within(const StandPlane& plane, const Eigen::Vector3d& p, double margin) const {
  return cv::pointPolygonTest(plane.hull, OnPlane(p), true) >= margin;
}

std::vector<cv::Point2f> KnownSurfaces::Footprint(const Solid& solid) const {
  std::vector<cv::Point2f> corners;
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      corners.push_back(OnPlane(solid.T_map_object *
                                Eigen::Vector3d(x * solid.half_size.x(), y * solid.half_size.y(), 0.0)));
    }
  }
  return corners;
}

double KnownSurfaces::Bottom(const Solid& solid) const {
  return up_.dot(solid.T_map_object.translation) - solid.half_size.z();
}

void KnownSurfaces::AddFootprint(const Solid& solid) {
  constexpr double kSame = 0.003;  // metres
  const double bottom = Bottom(solid);
  auto plane =
      std::ranges::find_if(planes_, [&](const StandPlane& p) { return std::abs(p.height - bottom) < kSame; });
  if (plane == planes_.end()) {
    plane = planes_.insert(plane, {bottom, 0, {}, {}});
  }
  ++plane->solids;
  for (const cv::Point2f& corner : Footprint(solid)) {
    plane->footprints.push_back(corner);
  }
}

// A rug lies on the floor: if planes are this close to each other, any may be the right one.
double KnownSurfaces::DistanceToPlanes(double hit, double height) const {
  constexpr double kNear = 0.02;  // metres
  double least = kFar;
  for (const StandPlane& plane : planes_) {
    if (std::abs(plane.height - hit) < kNear) {
      least = std::min(least, std::abs(plane.height - height));
    }
  }
  return least;
}

bool KnownSurfaces::StandsOver(const Solid& solid, const StandPlane& plane, const Eigen::Vector3d& p,
                               double margin) const {
  constexpr double kOnIt = 0.03;  // metres between an object's bottom and the table top
  if (std::abs(Bottom(solid) - plane.height) > kOnIt) {
    return false;
  }
  std::vector<cv::Point2f> hull;
  cv::convexHull(Footprint(solid), hull);
  return cv::pointPolygonTest(hull, OnPlane(p), true) >= -margin;
}

std::optional<KnownSurfaces::StandPlane> KnownSurfaces::Table() const {
  const GroundTruthObject* widest = nullptr;
  const auto width = [](const GroundTruthObject& object) {
    return object.solid.half_size.x() * object.solid.half_size.y();
  };
  for (const GroundTruthObject& object : objects_) {
    if (object.label == "dining_table" && (widest == nullptr || width(object) > width(*widest))) {
      widest = &object;
    }
  }
  if (widest != nullptr) {
    const Solid& solid = widest->solid;
    StandPlane top{Bottom(solid) + 2.0 * solid.half_size.z(), 1, Footprint(solid), {}};
    cv::convexHull(top.footprints, top.hull);
    return top;
  }
  const auto most =
      std::ranges::max_element(planes_, [](const auto& a, const auto& b) { return a.solids < b.solids; });
  return most != planes_.end() && most->solids > 2 ? std::optional(*most) : std::nullopt;
}

}  // namespace sqslam
