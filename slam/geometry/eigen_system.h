#pragma once

#include <Eigen/Core>

namespace sqslam {

// Eigenvalues of a symmetric matrix, ascending, and the unit eigenvectors as columns.
template <int N>
struct EigenSystem {
  Eigen::Matrix<double, N, 1> values;
  Eigen::Matrix<double, N, N> vectors;
};

// Uses Eigen's SelfAdjointEigenSolver, whose templates are only compiled here. NaN in, NaN out.
EigenSystem<2> EigenSystemOf(const Eigen::Matrix2d& symmetric);
EigenSystem<3> EigenSystemOf(const Eigen::Matrix3d& symmetric);
EigenSystem<4> EigenSystemOf(const Eigen::Matrix4d& symmetric);

}  // namespace sqslam
