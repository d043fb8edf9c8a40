#include "render/gl/lens.h"

#include <vtkCamera.h>
#include <vtkMatrix3x3.h>
#include <vtkMatrix4x4.h>
#include <vtkOpenGLCamera.h>
#include <vtkRenderer.h>

#include <Eigen/LU>

namespace sqslam {

std::array<float, 4> Floats(const Eigen::Vector4d& v) {
  const Eigen::Vector4f f = v.cast<float>();
  return {f[0], f[1], f[2], f[3]};
}

Lens::Lens(vtkRenderer* renderer, const Eigen::Vector4d& ground_map) {
  auto* camera = vtkOpenGLCamera::SafeDownCast(renderer->GetActiveCamera());
  vtkMatrix4x4* to_view = nullptr;
  vtkMatrix3x3* normals = nullptr;
  vtkMatrix4x4* projection = nullptr;
  vtkMatrix4x4* whole = nullptr;
  camera->GetKeyMatrices(renderer, to_view, normals, projection, whole);
  // VTK stores the matrices transposed, as OpenGL reads them.
  const auto element = [&](int row, int column) {
    return static_cast<float>(projection->GetElement(column, row));
  };
  terms = {element(0, 0), element(1, 1), element(0, 2), element(1, 2)};
  depth_range = {static_cast<float>(camera->GetClippingRange()[0]),
                 static_cast<float>(camera->GetClippingRange()[1])};
  const Eigen::Matrix4d T_view_map = Eigen::Map<const Eigen::Matrix4d>(to_view->GetData());
  T_device_map = Eigen::Map<const Eigen::Matrix4d>(whole->GetData());
  ground = Floats(T_view_map.inverse().transpose() * ground_map);
}

}  // namespace sqslam
