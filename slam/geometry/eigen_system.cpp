#include "slam/geometry/eigen_system.h"

#include <Eigen/Eigenvalues>

namespace sqslam {
namespace {

template <int N>
EigenSystem<N> Solve(const Eigen::Matrix<double, N, N>& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace

EigenSystem<2> EigenSystemOf(const Eigen::Matrix2d& symmetric) { return Solve<2>(symmetric); }
EigenSystem<3> EigenSystemOf(const Eigen::Matrix3d& symmetric) { return Solve<3>(symmetric); }
EigenSystem<4> EigenSystemOf(const Eigen::Matrix4d& symmetric) { return Solve<4>(symmetric); }

}  // namespace sqslam
