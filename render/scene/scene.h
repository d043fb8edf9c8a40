#pragma once

#include <Eigen/Core>
#include <memory>

#include "render/camera/camera_path.h"
#include "render/camera/scene_framing.h"
#include "render/scene/scene_layers.h"
#include "render/scene/style.h"
#include "slam/snapshot/snapshot.h"

class vtkRenderer;

namespace sqslam {

// A map as VTK props in one renderer: grid, points, trajectory, frusta, superquadrics. For any window,
// off-screen or on the desktop; text is not part of it. Uses the OpenGL context that is current.
class Scene {
 public:
  // The renderer's own pixels against those of the picture.
  struct Quality {
    double pixel_scale = 1.0;  // pixels of the window for one pixel of the style's sizes
    int samples = 2;           // drawn along each side of a pixel
    bool fxaa = false;         // smooth edges afterwards
    bool transparent = false;  // no background: colours are then multiplied by alpha
    bool draft = false;        // shadows of fewer directions of light, while something moves
  };
  Scene(const SceneStyle& style, const Quality& quality);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  vtkRenderer* Renderer() const;

  // Shows the snapshot. `focus` gives the scale of the frusta, the place of the grid and where light comes
  // from; keep the same one over the frames of a video.
  void Show(const MapSnapshot& map, const SceneFocus& focus, const LabelColors& colors);

  // Draws these with every map from now on; in the frame of the maps.
  void SetLayers(const SceneLayers& layers);

  // Cuts as this says instead of as the style does.
  void SetClip(const SceneStyle::Clip& clip);

  // Places the camera, puts translucent surfaces in order for it and chooses their detail for a window of
  // this height (pixels). To be called before each frame.
  void LookFrom(const ViewCamera& camera, int height);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
