#include "render/gl/camera_setup.h"

#include <vtkCamera.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>

namespace sqslam {

void SetPinholeCamera(const Camera& camera, const Rigid3d& T_map_camera, double near_plane, double far_plane,
                      vtkCamera* vtk_camera) {
  const Eigen::Vector3d position = T_map_camera.translation;
  const Eigen::Vector3d focal = T_map_camera * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d up = T_map_camera.rotation * -Eigen::Vector3d::UnitY();
  vtk_camera->SetPosition(position.x(), position.y(), position.z());
  vtk_camera->SetFocalPoint(focal.x(), focal.y(), focal.z());
  vtk_camera->SetViewUp(up.x(), up.y(), up.z());
  vtk_camera->SetClippingRange(near_plane, far_plane);

  // Normalised device coordinates of pixel (u, v): x = 2 (u + 0.5) / width - 1, y = 1 - 2 (v + 0.5) / height,
  // with OpenGL's camera looking along -z and y up.
  vtkNew<vtkMatrix4x4> projection;
  projection->Zero();
  projection->SetElement(0, 0, 2.0 * camera.fx / camera.width);
  projection->SetElement(0, 2, 1.0 - 2.0 * (camera.cx + 0.5) / camera.width);
  projection->SetElement(1, 1, 2.0 * camera.fy / camera.height);
  projection->SetElement(1, 2, 2.0 * (camera.cy + 0.5) / camera.height - 1.0);
  projection->SetElement(2, 2, -(far_plane + near_plane) / (far_plane - near_plane));
  projection->SetElement(2, 3, -2.0 * far_plane * near_plane / (far_plane - near_plane));
  projection->SetElement(3, 2, -1.0);
  vtk_camera->SetExplicitProjectionTransformMatrix(projection);
  vtk_camera->UseExplicitProjectionTransformMatrixOn();
}

}  // namespace sqslam
