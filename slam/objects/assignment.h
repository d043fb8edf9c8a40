#pragma once

#include <Eigen/Core>
#include <vector>

namespace sqslam {

// Optimal assignment (Hungarian method with potentials, O(n^2 m)). `gain`: rows x columns, entries <= 0 mean
// "impossible". Returns for each row the column it is assigned to, or -1; the sum of the gains is the
// largest.
std::vector<int> AssignOptimally(const Eigen::MatrixXd& gain);

}  // namespace sqslam
