#pragma once

#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkUnsignedCharArray.h>

#include <opencv2/core.hpp>

#include "render/gl/offscreen_context.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

class vtkCamera;

namespace sqslam {

// A VTK render window on an OffscreenContext. For the sources of render/ only.
class OffscreenWindow {
 public:
  struct Options {
    int width = 640;     // pixels
    int height = 480;    // pixels
    bool alpha = false;  // with an alpha channel, for transparent backgrounds
    RenderBackend backend = RenderBackend::kAuto;
  };

  explicit OffscreenWindow(const Options& options);
  ~OffscreenWindow();
  OffscreenWindow(const OffscreenWindow&) = delete;
  OffscreenWindow& operator=(const OffscreenWindow&) = delete;

  void AddRenderer(vtkRenderer* renderer) { window_->AddRenderer(renderer); }

  // Draws and reads back: 8UC3 (BGR), or 8UC4 (BGRA, not premultiplied) with alpha; top row first.
  cv::Mat Render();

  // Draws without reading back. Returns the name of an OpenGL texture of the window's size, bottom row first,
  // that is valid until the next call or change of size.
  unsigned Draw();

  OffscreenContext& Context() { return context_; }

 private:
  OffscreenContext context_;
  vtkNew<vtkGenericOpenGLRenderWindow> window_;
  vtkNew<vtkUnsignedCharArray> pixels_;
  bool alpha_;
};

// Makes VTK's camera see exactly what a pinhole camera at T_map_camera sees, without distortion. Converts
// between the pixel conventions: centres lie at whole numbers in Camera, half a pixel from the border in
// OpenGL. The picture may have any multiple of the camera's size. Near and far planes in map units.
void SetPinholeCamera(const Camera& camera, const Rigid3d& T_map_camera, double near_plane, double far_plane,
                      vtkCamera* vtk_camera);

}  // namespace sqslam
