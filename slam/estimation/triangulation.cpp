#include "slam/estimation/triangulation.h"

#include <Eigen/Eigenvalues>

namespace sqslam {

Eigen::Vector3d Triangulate(const Rigid3d& T_camera1_map, const Eigen::Vector3d& ray1,
                            const Rigid3d& T_camera2_map, const Eigen::Vector3d& ray2) {
  const Eigen::Matrix<double, 3, 4> P1 = T_camera1_map.Matrix().topRows<3>();
  const Eigen::Matrix<double, 3, 4> P2 = T_camera2_map.Matrix().topRows<3>();
  Eigen::Matrix4d A;
  A.row(0) = ray1.x() * P1.row(2) - P1.row(0);
  A.row(1) = ray1.y() * P1.row(2) - P1.row(1);
  A.row(2) = ray2.x() * P2.row(2) - P2.row(0);
  A.row(3) = ray2.y() * P2.row(2) - P2.row(1);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(A.transpose() * A);
  const Eigen::Vector4d h = solver.eigenvectors().col(0);
  return h.head<3>() / h.w();
}

double CosParallax(const Eigen::Vector3d& p_map, const Eigen::Vector3d& center1,
                   const Eigen::Vector3d& center2) {
  return (center1 - p_map).normalized().dot((center2 - p_map).normalized());
}

}  // namespace sqslam
