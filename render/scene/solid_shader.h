#pragma once

#include <Eigen/Core>
#include <string>

class vtkActor;

// The shader of superquadrics: light of the studio, and what PicturePass wants to know of surfaces. For the
// sources of render/ only.
namespace sqslam {

struct SolidShading {
  int number = 0;                      // 1, 2, ...: what outlines tell apart
  const char* number_array = nullptr;  // instead of `number`: a data array of the vertices
  bool far_side = false;               // seen through the near side only
  double roughness = 0.5;
  double metallic = 0.0;
};
void SetSolidShader(vtkActor* actor, const SolidShading& shading);

// Directions of the studio seen from the camera (x right, y up, z towards the viewer); for each view.
struct StudioInView {
  Eigen::Vector3d up, lamp, window;
};
void SetStudio(vtkActor* actor, const StudioInView& studio);

}  // namespace sqslam
