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

// A map as VTK props in one renderer: grid, points, trajectory, frusta, superquadrics. For any window,
// off-screen or on the desktop; text is not part of it. Uses the OpenGL context that is current. For the
// sources of render/ only.
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

  vtkRenderer* Renderer() const { return renderer_; }

  // Shows the snapshot. `focus` gives the scale of the frusta, the place of the grid and where light comes
  // from; keep the same one over the frames of a video.
  void Show(const MapSnapshot& map, const SceneFocus& focus, const LabelColors& colors);

  // Draws these with every map from now on; in the frame of the maps.
  void SetLayers(const SceneLayers& layers);

  // Cuts as this says instead of as the style does.
  void SetClip(const SceneStyle::Clip& clip) { style_.clip = clip; }

  // Places the camera, puts translucent surfaces in order for it and chooses the detail of all for a window
  // of this size (pixels). To be called before each frame.
  void LookFrom(const ViewCamera& camera, cv::Size size);

 private:
  bool HasMesh() const { return style_.dense_cloud.show && mesh_ != nullptr; }
  bool HasCloud() const { return style_.dense_cloud.show && shown_cloud_ != nullptr && !HasMesh(); }
  bool IsDense() const { return HasCloud() || HasMesh(); }
  ObjectLook Look() const;
  void ShowSolids();
  void ShowMesh();
  void GrowMesh();
  void ArrangePoints(const ViewCamera& view, cv::Size size, const std::optional<ClipPlane>& clip,
                     PictureLayers& layers);
  double Scale() const { return quality_.pixel_scale * quality_.samples; }
  void Cut(const std::optional<ClipPlane>& plane);
  void CastShadow(const std::optional<ClipPlane>& plane);
  PictureEffects Effects() const;

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
  vtkNew<vtkPlaneCollection> clip_planes_;  // that one or none; all that is cut shares it
  PointSplats points_;
  CloudView cloud_;
  CloudLayerPtr shown_cloud_;
  SurfaceMeshPtr shown_mesh_;
  vtkSmartPointer<vtkActor> mesh_;           // null: none is to be seen
  std::set<std::int64_t> mesh_frames_;       // from which parts of it are seen
  std::optional<std::int64_t> grown_until_;  // the last of them that is shown
  std::int64_t frame_ = 0;                   // of the map
  vtkSmartPointer<vtkActor> true_path_;
  vtkSmartPointer<vtkActor> trajectory_;
  vtkSmartPointer<vtkActor> frusta_;
  vtkSmartPointer<vtkActor> current_;
  vtkSmartPointer<vtkActor> uncertain_;
  SolidActors solids_;
  std::vector<SnapshotObject> solid_objects_;  // that `solids_` shows
  LabelColors colors_;
  std::vector<double> cast_;  // numbers that the shadow shown was cast from: the ground, the lamp, the solids
};

}  // namespace sqslam
