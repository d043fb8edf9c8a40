#pragma once

#include <Eigen/Core>
#include <vector>

namespace sqslam {

// Optimal assignment (Hungarian method with potentials, O(n^2 m)). `gain`: rows x columns, entries <= 0 mean
// "impossible". Returns for each row its assigned column, or -1, maximising the total gain.
std::vector<int> AssignOptimally(const Eigen::MatrixXd& gain);

}  // namespace sqslam
