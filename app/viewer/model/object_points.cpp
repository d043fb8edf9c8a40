#include "app/viewer/model/object_points.h"

#include <memory>

#include "slam/fitting/surface_measures.h"

namespace sqslam::viewer {

std::vector<ObjectPoint> ObjectPoints(const MapSnapshot& map, const SnapshotObject& object) {
  const SurfaceDistance distance(object.superquadric.shape);
  const Rigid3d T_object_map = object.superquadric.T_map_object.Inverse();
  std::vector<ObjectPoint> points;
  for (const SnapshotPoint& point : map.points) {
    if (point.object_id != object.id && point.rejected_by != object.id) {
      continue;
    }
    const Eigen::Vector3d p = point.p_map.cast<double>();
    points.push_back(
        {p, distance(T_object_map * p), static_cast<double>(point.anomaly), point.object_id == object.id});
  }
  return points;
}

MapSnapshotPtr Represented(const MapSnapshotPtr& map, Representation representation) {
  if (representation == Representation::kSuperquadric || !map) {
    return map;
  }
  auto represented = std::make_shared<MapSnapshot>(*map);
  for (SnapshotObject& object : represented->objects) {
    Superquadric& shape = object.superquadric.shape;
    shape.e1 = shape.e2 = representation == Representation::kEllipsoid ? 1.0 : kMinShapeExponent;
  }
  return represented;
}

}  // namespace sqslam::viewer
