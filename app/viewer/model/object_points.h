#pragma once

#include <Eigen/Core>
#include <vector>

#include "slam/snapshot/snapshot.h"

namespace sqslam::viewer {

// A map point of an object, or one that its outlier removal took away.
struct ObjectPoint {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  double residual = 0.0;  // signed distance to the object's surface, map units; below 0 inside
  double anomaly = 0.0;   // isolation score in [0, 1]; 0 where it has none
  bool kept = true;
};

std::vector<ObjectPoint> ObjectPoints(const MapSnapshot& map, const SnapshotObject& object);

// The shape that objects are shown in: the others have the same place and size with both exponents 1, or 0.1,
// as the option `objects.representation` of a run makes them.
enum class Representation { kSuperquadric, kEllipsoid, kCuboid };

// Returns the snapshot itself for superquadrics.
MapSnapshotPtr Represented(const MapSnapshotPtr& map, Representation representation);

}  // namespace sqslam::viewer
