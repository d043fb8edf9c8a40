#include "render/scene/scene.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkLight.h>
#include <vtkNew.h>
#include <vtkOpenGLRenderer.h>
#include <vtkPlane.h>
#include <vtkPlaneCollection.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkTexture.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "render/gl/offscreen_window.h"
#include "render/gl/picture_pass.h"
#include "render/scene/clip_plane.h"
#include "render/scene/point_actors.h"
#include "render/scene/scene_geometry.h"
#include "render/scene/solid_actors.h"
#include "render/scene/studio_light.h"
#include "render/solids/ground_shadow.h"

namespace sqslam {
namespace {

vtkSmartPointer<vtkActor> MakeActor(double width) {
  const vtkNew<vtkPolyDataMapper> mapper;
  const auto actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  actor->GetProperty()->SetLighting(false);
  actor->GetProperty()->SetLineWidth(static_cast<float>(width));
  actor->GetProperty()->SetPointSize(static_cast<float>(width));
  return actor;
}

void SetGeometry(vtkActor* actor, vtkPolyData* geometry, bool show) {
  vtkPolyDataMapper::SafeDownCast(actor->GetMapper())->SetInputData(geometry);
  actor->SetVisibility(show && geometry->GetNumberOfPoints() > 0);
}

}  // namespace

struct Scene::Impl {
  Impl(const SceneStyle& wanted, const Quality& wanted_quality)
      : style(wanted),
        quality(wanted_quality),
        grid(MakeActor(style.grid.width * Scale())),
        shadow(MakeActor(1.0)),
        covisibility(MakeActor(style.covisibility.width * Scale())),
        points(style.points.size * Scale(), clip_planes),
        object_points(style.points.object_size * Scale(), clip_planes),
        dense_cloud(style.dense_cloud.size * Scale(), clip_planes),
        true_path(MakeActor(style.ground_truth.width * Scale())),
        trajectory(MakeActor(style.cameras.width * Scale())),
        frusta(MakeActor(style.cameras.keyframe_width * Scale())),
        current(MakeActor(2.0 * style.cameras.keyframe_width * Scale())),
        solids(style.objects, clip_planes) {
    renderer->AutomaticLightCreationOff();
    renderer->AddLight(vtkNew<vtkLight>());  // not used: solids have light of their own, all else has none
    for (const auto& actor : {grid, shadow, covisibility}) {
      actor->ForceTranslucentOn();
      renderer->AddActor(actor);
    }
    for (const auto& actor : {true_path, trajectory, frusta, current}) {
      actor->ForceOpaqueOn();
      renderer->AddActor(actor);
    }
    renderer->SetPass(pass);
  }

  double Scale() const { return quality.pixel_scale * quality.samples; }
  void Cut(const std::optional<ClipPlane>& plane);
  void CastShadow(const std::optional<ClipPlane>& plane);
  PictureEffects Effects() const;

  SceneStyle style;
  Quality quality;
  SceneFocus focus;
  vtkNew<vtkOpenGLRenderer> renderer;
  vtkNew<PicturePass> pass;
  Studio studio;
  vtkSmartPointer<vtkActor> grid;
  vtkSmartPointer<vtkActor> shadow;
  vtkSmartPointer<vtkActor> covisibility;
  vtkNew<vtkPlane> clip_plane;
  vtkNew<vtkPlaneCollection> clip_planes;  // that one or none; all that is cut shares it
  PointActors points;
  PointActors object_points;
  PointActors dense_cloud;
  std::shared_ptr<const ColoredPoints> shown_cloud;
  vtkSmartPointer<vtkActor> true_path;
  vtkSmartPointer<vtkActor> trajectory;
  vtkSmartPointer<vtkActor> frusta;
  vtkSmartPointer<vtkActor> current;
  SolidActors solids;
  std::vector<PosedSuperquadric> casters;    // of shadows, where nothing is cut
  std::optional<std::vector<bool>> casting;  // which of them the shadow shows; empty: none was cast yet
};

void Scene::Impl::Cut(const std::optional<ClipPlane>& plane) {
  if (!plane) {
    clip_planes->RemoveAllItems();
    return;
  }
  const Eigen::Vector3d at = plane->height * plane->normal;
  const Eigen::Vector3d kept = -plane->normal;  // VTK keeps what lies in front of a plane
  clip_plane->SetOrigin(at.data());
  clip_plane->SetNormal(kept.data());
  if (clip_planes->GetNumberOfItems() == 0) {
    clip_planes->AddItem(clip_plane);
  }
}

// The shadow of the solids that are not cut away; cast anew where they are others.
void Scene::Impl::CastShadow(const std::optional<ClipPlane>& plane) {
  std::vector<bool> kept;
  std::vector<PosedSuperquadric> solids_there;
  for (const PosedSuperquadric& solid : casters) {
    kept.push_back(!plane || plane->KeepsSomeOf(solid));
    if (kept.back()) {
      solids_there.push_back(solid);
    }
  }
  if (casting == kept) {
    return;
  }
  casting = std::move(kept);
  ShadowLight light;
  light.towards = studio.Lamp();
  if (quality.draft) {
    light.lamp_samples = light.sky_samples = 8;
  }
  const GroundShadow cast = CastGroundShadow(solids_there, focus.up, focus.ground_height, light);
  shadow->SetVisibility(!cast.darkness.empty());
  if (!cast.darkness.empty()) {
    SetGeometry(shadow, ShadowQuad(cast), true);
    shadow->SetTexture(ShadowTexture(cast, style.light.shadow));
  }
}

PictureEffects Scene::Impl::Effects() const {
  PictureEffects effects;
  effects.samples = quality.samples;
  effects.fxaa = quality.fxaa;
  effects.occlusion = style.light.ambient_occlusion;
  effects.occlusion_radius = style.light.occlusion_radius * focus.radius;
  effects.outline = style.light.outline;
  effects.outline_width = style.light.outline_width * quality.pixel_scale;
  effects.outline_color = ParseColor(style.light.outline_color);
  effects.eye_dome = style.light.eye_dome;
  if (quality.transparent) {
    effects.background.setZero();
  } else {
    effects.background << ParseColor(style.background), 1.0;
  }
  effects.has_ground = style.light.shadow > 0.0;
  effects.ground_plane << focus.up, -focus.ground_height;
  return effects;
}

Scene::Scene(const SceneStyle& style, const Quality& quality)
    : impl_(std::make_unique<Impl>(style, quality)) {}
Scene::~Scene() = default;

vtkRenderer* Scene::Renderer() const { return impl_->renderer; }

void Scene::Show(const MapSnapshot& map, const SceneFocus& focus, const LabelColors& colors) {
  Impl& s = *impl_;
  s.focus = focus;
  const SceneStyle& style = s.style;
  SetGeometry(s.grid, GroundGrid(focus, style), style.grid.show);
  s.points.Show(PointCloud(map, false, style));
  s.object_points.Show(PointCloud(map, true, style));
  const double frustum = 2.0 * style.cameras.size * std::min(focus.radius, focus.view_depth);
  SetGeometry(s.trajectory, TrajectoryLine(map, style), style.cameras.trajectory);
  SetGeometry(s.frusta, KeyframeFrusta(map, frustum, style), style.cameras.keyframes);
  SetGeometry(s.current, CurrentFrustum(map, 1.6 * frustum, style), style.cameras.current);
  SetGeometry(s.covisibility, CovisibilityLines(map, style), style.covisibility.show);
  s.studio = {focus.up, focus.front};
  s.casters.clear();
  s.casting.reset();
  for (const SnapshotObject& object : map.objects) {
    const Eigen::Vector3d offset = object.superquadric.T_map_object.translation - focus.center;
    if (offset.norm() < 3.0 * focus.radius) {  // one stray object would cost all others their sharpness
      s.casters.push_back(object.superquadric);
    }
  }
  s.solids.Show(map.objects, colors);
  s.pass->SetEffects(s.Effects());
}

void Scene::SetLayers(const SceneLayers& layers) {
  Impl& s = *impl_;
  SetGeometry(s.true_path, PathLines(layers.true_path, ParseColor(s.style.ground_truth.color)),
              s.style.ground_truth.show);
  if (s.shown_cloud != layers.dense_cloud) {
    s.shown_cloud = layers.dense_cloud;
    s.dense_cloud.Show(DensePoints(s.shown_cloud ? *s.shown_cloud : ColoredPoints(), s.style));
  }
}

void Scene::SetClip(const SceneStyle::Clip& clip) { impl_->style.clip = clip; }

void Scene::LookFrom(const ViewCamera& view, int height) {
  Impl& s = *impl_;
  const std::optional<ClipPlane> clip = MakeClipPlane(s.style.clip, s.focus, view);
  s.Cut(clip);
  if (s.style.light.shadow > 0.0 && s.style.objects.show) {
    s.CastShadow(clip);
  } else {
    s.shadow->SetVisibility(false);
  }
  PictureLayers layers;
  const auto add = [](const vtkSmartPointer<vtkActor>& actor, std::vector<vtkProp*>& layer) {
    if (actor->GetVisibility() != 0) {
      layer.push_back(actor);
    }
  };
  const double samples = height * s.quality.samples;
  const auto add_points = [&](const PointActors& points) {
    for (vtkActor* actor : points.Arrange(view, samples)) {
      layers.opaque.push_back(actor);
    }
  };
  add_points(s.dense_cloud);
  if (s.style.points.show) {
    add_points(s.points);
    add_points(s.object_points);
  }
  for (const auto& actor : {s.true_path, s.trajectory, s.frusta, s.current}) {
    add(actor, layers.opaque);
  }
  for (const auto& actor : {s.shadow, s.grid, s.covisibility}) {
    add(actor, layers.ground);
  }
  layers.solids = s.solids.Arrange(view, samples, s.studio);
  s.pass->SetLayers(std::move(layers));
  vtkCamera* camera = s.renderer->GetActiveCamera();
  camera->SetPosition(view.position.data());
  camera->SetFocalPoint(view.focal_point.data());
  camera->SetViewUp(view.view_up.data());
  camera->SetViewAngle(view.view_angle);
  // From what the picture is about, not from the bounds of all points: one stray point would cost the depth
  // buffer its precision.
  const double reach = (view.position - s.focus.center).norm() + s.focus.radius;
  camera->SetClippingRange(0.01 * reach, 12.0 * reach);
  camera->UseExplicitProjectionTransformMatrixOff();
  if (view.pinhole) {
    SetPinholeCamera(*view.pinhole, PoseOf(view), 0.01 * reach, 12.0 * reach, camera);
  }
}

}  // namespace sqslam
