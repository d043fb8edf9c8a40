#pragma once

#include <vtkRenderPass.h>
#include <vtkSmartPointer.h>

#include <Eigen/Core>
#include <memory>
#include <vector>

class vtkActor;
class vtkProp;

namespace sqslam {

class PointSplats;

// The effects that PicturePass adds to a drawn scene. Widths in pixels of the picture.
struct PictureEffects {
  int samples = 2;                // along each side of a pixel, 1 or 2
  bool fxaa = false;              // smooth edges of the picture afterwards
  double occlusion = 0.0;         // strength of ambient occlusion on solids, [0, 1]
  double occlusion_radius = 0.1;  // reach of ambient occlusion, map units
  double outline = 0.0;           // opacity of the lines around solids, [0, 1]
  double outline_width = 1.0;
  Eigen::Vector3d outline_color = Eigen::Vector3d::Zero();
  bool see_through = false;  // solids hide nothing, and their lines have the colours of the layers
  Eigen::Vector3f surface_range = Eigen::Vector3f::Ones();  // see SolidActors::Surroundings
  double eye_dome = 0.0;  // how strongly points stand out against points behind them, [0, 1]
  Eigen::Vector4d background = Eigen::Vector4d::Ones();    // red, green, blue times alpha, and alpha
  bool has_ground = false;                                 // the plane takes part in ambient occlusion
  Eigen::Vector4d ground_plane = Eigen::Vector4d::Zero();  // n . p + d = 0 in the map frame
};

// Props in the order in which they are drawn.
struct PictureLayers {
  std::vector<PointSplats*> points;
  std::vector<vtkProp*> opaque;   // lines
  std::vector<vtkProp*> ground;   // blended over them: shadow and grid
  std::vector<vtkActor*> solids;  // farthest first where they are translucent; shaded as SolidActors does
  std::vector<Eigen::Vector3d> line_colors;  // of see-through solids, by their numbers from 1
};

// Draws a scene in layers and finishes the picture in screen space: ambient occlusion, outlines, eye-dome
// lighting, and several samples a pixel brought down to one. Translucent solids are plainly blended in the
// order they come in: they are convex, so that drawing the far side before the near side, farthest solid
// first, is exact without depth peeling.
class PicturePass : public vtkRenderPass {
 public:
  static PicturePass* New();
  vtkTypeMacro(PicturePass, vtkRenderPass);

  void SetEffects(const PictureEffects& effects);
  void SetLayers(PictureLayers layers);

  void Render(const vtkRenderState* state) override;
  void ReleaseGraphicsResources(vtkWindow* window) override;

  PicturePass(const PicturePass&) = delete;
  PicturePass& operator=(const PicturePass&) = delete;

 protected:
  PicturePass();
  ~PicturePass() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
