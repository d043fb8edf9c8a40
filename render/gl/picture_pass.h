#pragma once

#include <vtkRenderPass.h>
#include <vtkSmartPointer.h>

#include <Eigen/Core>
#include <memory>
#include <vector>

class vtkActor;

namespace sqslam {

class PointSplats;

// The effects that PicturePass adds to a scene. Widths in pixels of the picture.
struct PictureEffects {
  int samples = 2;                                          // along each side of a pixel, 1 or 2
  bool fxaa = false;                                        // smooth edges in the finished picture
  double occlusion = 0.0;                                   // strength of ambient occlusion on solids, [0, 1]
  double occlusion_radius = 0.1;                            // reach of ambient occlusion, map units
  Eigen::Vector2d line_widths = Eigen::Vector2d::Ones();    // around solids, around glass
  bool see_through = false;                                 // solids hide nothing
  Eigen::Vector3f surface_range = Eigen::Vector3f::Ones();  // see SolidActors::Surroundings
  double eye_dome = 0.0;  // how strongly points stand out against points behind them, [0, 1]
  Eigen::Vector4d background = Eigen::Vector4d::Ones();    // premultiplied RGBA
  bool has_ground = false;                                 // ground_plane takes part in ambient occlusion
  Eigen::Vector4d ground_plane = Eigen::Vector4d::Zero();  // n . p + d = 0 in the map frame
};

// Actors of polygonal data in drawing order.
struct PictureLayers {
  std::vector<PointSplats*> points;
  std::vector<vtkActor*> opaque;  // lines
  std::vector<vtkActor*> ground;  // shadow and grid, blended over the above
  std::vector<vtkActor*> solids;  // if translucent, farthest first; shaded by SolidActors
  std::vector<Eigen::Vector4d>
      lines;  // RGBA of those around solids, in the order of their numbers; may be empty
};

// Draws a scene in layers and finishes it in screen space: ambient occlusion, outlines, eye-dome lighting,
// and averaging of several samples per pixel. Translucent solids are blended in the given order. As they are
// convex, drawing the farthest solid first, and its far side before its near side, is exact without
// depth peeling.
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
