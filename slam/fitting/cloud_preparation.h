#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "slam/geometry/rigid3.h"

namespace sqslam {

// A cloud in a frame that moves, turns and grows with it: whatever is computed there commutes with
// similarities of the cloud, and does not depend on the order of the points.
struct CanonicalCloud {
  Sim3d S_map_canonical;                // p_map = S * p_canonical
  std::vector<Eigen::Vector3d> points;  // canonical; sorted by their coordinates
  std::vector<std::size_t> source;      // index in the cloud of each of `points`
};

// Origin: a mean that far points pull little; axes: principal axes with the signs of the third moments; unit:
// the root mean square distance from the origin, likewise weighted. `upright` keeps the z axis and turns
// about it only. Throws InputError for fewer than 11 points, or points that all coincide.
CanonicalCloud ToCanonicalFrame(std::span<const Eigen::Vector3d> cloud, bool upright);

struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit length
  double offset = 0.0;                                // normal . p on the plane

  double Distance(const Eigen::Vector3d& p) const { return normal.dot(p) - offset; }  // signed
};

// The plane with the most points within `distance` (RANSAC, then least squares over those points).
// `horizontal`: only planes whose normal is within 15 degrees of z. Empty where the points are fewer than
// three or no three of them span such a plane.
std::optional<Plane> FindLargestPlane(const std::vector<Eigen::Vector3d>& points, double distance,
                                      bool horizontal, std::uint64_t seed);

// Splits the points with the given indices where there are gaps (density-based clustering, Ester et al., KDD
// 1996). Two dense points within the radius belong together; a point is dense that has eight
// neighbours within the radius; one that is not dense goes with the nearest dense one within the
// radius, or to no cluster (stray outliers). The radius is `distance` times the median distance to the eighth
// neighbour. Returns indices, largest cluster first.
std::vector<std::vector<std::size_t>> ClusterPoints(const std::vector<Eigen::Vector3d>& points,
                                                    const std::vector<std::size_t>& indices, double distance);

}  // namespace sqslam
