#pragma once

#include <Eigen/Core>
#include <vector>

namespace sqslam {

// Splits the points with the given indices where there are gaps (density-based clustering, Ester et al., KDD
// 1996). Two dense points within the radius belong together; a point is dense that has eight
// neighbours within the radius; one that is not dense goes with the nearest dense one within the
// radius, or to no cluster (stray outliers). The radius is `distance` times the median distance to the eighth
// neighbour. Returns indices, largest cluster first.
std::vector<std::vector<std::size_t>> ClusterPoints(const std::vector<Eigen::Vector3d>& points,
                                                    const std::vector<std::size_t>& indices, double distance);

}  // namespace sqslam
