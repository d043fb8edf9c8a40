#pragma once

#include <vtkActor.h>
#include <vtkNew.h>
#include <vtkOpenGLRenderer.h>
#include <vtkPlane.h>
#include <vtkPlaneCollection.h>
#include <vtkSmartPointer.h>

#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <vector>

#include "render/camera/camera_path.h"
#include "render/camera/scene_framing.h"
#include "render/gl/picture_pass.h"
#include "render/gl/point_splats.h"
#include "render/scene/clip_plane.h"
#include "render/scene/cloud_view.h"
#include "render/scene/solid_actors.h"
#include "render/scene/studio_light.h"
#include "render/scene/style.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// A map as VTK props in one renderer: grid, points, trajectory, frusta, superquadrics, but no text. For any
// window, off-screen or on the desktop. Uses the current OpenGL context. For the sources of render/ only.
class Scene {
 public:
  // Resolution and smoothing of the drawing.
  struct Quality {
    double pixel_scale = 1.0;  // pixels of the window per pixel of the style
    int samples = 2;           // per side of a pixel
    bool fxaa = false;         // smooth edges in the finished picture
    bool transparent = false;  // no background, premultiplied alpha
    bool draft = false;        // shadows from fewer light directions, while something moves
  };
  Scene(const SceneStyle& style, const Quality& quality);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  vtkRenderer* Renderer() const { return renderer_; }

  // Shows the snapshot. `focus` determines the scale of the frusta, the place of the grid and the light; keep
  // the same one for all frames of a video.
  void Show(const MapSnapshot& map, const SceneFocus& focus, const LabelColors& colors);

  // Replaces the layers drawn with every map; in the map frame. The truth colours maps shown from then on.
  void SetLayers(const SceneLayers& layers);

  // Overrides the style's clip plane.
  void SetClip(const SceneStyle::Clip& clip) { style_.clip = clip; }

  // Places the camera, sorts translucent surfaces for it, and selects the detail for a window of this size
  // (pixels). Call before each frame.
  void LookFrom(const ViewCamera& wanted, cv::Size size);

 private:
  bool HasMesh() const { return style_.dense_cloud.show && mesh_ != nullptr; }
  bool HasCloud() const { return style_.dense_cloud.show && shown_cloud_ != nullptr && !HasMesh(); }
  bool IsDense() const { return HasCloud() || HasMesh(); }
  Eigen::Vector3d ColorOf(const SnapshotObject& object) const;
  void ShowSolids();
  void ShowMesh();
  void GrowMesh();
  void ArrangePoints(const ViewCamera& view, cv::Size size, const std::optional<ClipPlane>& clip,
                     PictureLayers& layers);
  void ArrangeLines(PictureLayers& layers);
  double Scale() const { return quality_.pixel_scale * quality_.samples; }
  void SetClipPlane(const std::optional<ClipPlane>& plane);
  void CastShadow(const std::optional<ClipPlane>& plane);
  PictureEffects Effects() const;
  std::vector<Eigen::Vector4d> Lines() const;

  SceneStyle style_;
  Quality quality_;
  SceneFocus focus_;
  vtkNew<vtkOpenGLRenderer> renderer_;
  vtkNew<PicturePass> pass_;
  Studio studio_;
  vtkSmartPointer<vtkActor> grid_;
  vtkSmartPointer<vtkActor> shadow_;
  vtkSmartPointer<vtkActor> covisibility_;
  vtkNew<vtkPlane> clip_plane_;
  vtkNew<vtkPlaneCollection> clip_planes_;  // clip_plane_ or none; shared by all clipped mappers
  PointSplats points_;
  CloudView cloud_;
  CloudLayerPtr shown_cloud_;
  SurfaceMeshPtr shown_mesh_;
  vtkSmartPointer<vtkActor> mesh_;                // null: none
  std::set<std::int64_t> mesh_frames_;            // frames at which parts of it appear
  std::optional<std::int64_t> mesh_shown_until_;  // the last of these frames shown
  std::int64_t frame_ = 0;                        // of the map
  vtkSmartPointer<vtkActor> true_path_;
  vtkSmartPointer<vtkActor> true_objects_;
  vtkSmartPointer<vtkActor> trajectory_;
  vtkSmartPointer<vtkActor> frusta_;
  vtkSmartPointer<vtkActor> current_;
  vtkSmartPointer<vtkActor> uncertain_;
  SolidActors solids_;
  std::vector<SnapshotObject> solid_objects_;  // that `solids_` shows
  LabelColors colors_;
  std::shared_ptr<const MapTruth> truth_;  // may be null
  std::vector<double> shadow_inputs_;      // inputs of the current shadow: ground, lamp, solids
};

}  // namespace sqslam
