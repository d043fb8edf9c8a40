#pragma once

#include <Eigen/Core>
#include <memory>

#include "render/camera_path.h"
#include "render/scene_framing.h"
#include "render/style.h"
#include "slam/map/snapshot.h"

class vtkRenderer;

namespace sqslam {

// A map as VTK props in one renderer: grid, points, trajectory, frusta, superquadrics. For any window,
// off-screen or on the desktop; text is not part of it. Uses the OpenGL context that is current.
class Scene {
 public:
  // pixel_scale: pixels of the window for one pixel of the style's sizes.
  Scene(const SceneStyle& style, double pixel_scale);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  vtkRenderer* Renderer() const;

  // Shows the snapshot. `focus` gives the scale of the frusta and the place of the grid; keep the same one
  // over the frames of a video.
  void Show(const MapSnapshot& map, const SceneFocus& focus, const LabelColors& colors);

  // Places the camera and puts translucent surfaces in order for it. To be called before each frame.
  void LookFrom(const ViewCamera& camera);

  // A transparent picture: colours are then multiplied by alpha.
  void SetTransparent(bool transparent);
  void SetSmoothEdges(bool fxaa);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
