#pragma once

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

class vtkCamera;

namespace sqslam {

// Makes VTK's camera see exactly what a pinhole camera at T_map_camera sees (distortion left out). Pixel
// centres lie at whole numbers in Camera and half a pixel off the border in OpenGL; this is where the two
// meet. The picture may have any multiple of the camera's size. near and far in map units.
void SetPinholeCamera(const Camera& camera, const Rigid3d& T_map_camera, double near_plane, double far_plane,
                      vtkCamera* vtk_camera);

}  // namespace sqslam
