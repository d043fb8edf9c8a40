#include "render/scene.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkLight.h>
#include <vtkNew.h>
#include <vtkOpenGLRenderer.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkTexture.h>

#include <algorithm>
#include <vector>

#include "render/gl/camera_setup.h"
#include "render/gl/picture_pass.h"
#include "render/ground_shadow.h"
#include "render/point_actors.h"
#include "render/scene_geometry.h"
#include "render/solid_actors.h"
#include "render/studio_light.h"

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
        points(style.points.size * Scale()),
        object_points(style.points.object_size * Scale()),
        trajectory(MakeActor(style.cameras.width * Scale())),
        frusta(MakeActor(style.cameras.keyframe_width * Scale())),
        current(MakeActor(2.0 * style.cameras.keyframe_width * Scale())),
        solids(style.objects) {
    renderer->AutomaticLightCreationOff();
    renderer->AddLight(vtkNew<vtkLight>());  // not used: solids have light of their own, all else has none
    for (const auto& actor : {grid, shadow}) {
      actor->ForceTranslucentOn();
      renderer->AddActor(actor);
    }
    for (const auto& actor : {trajectory, frusta, current}) {
      actor->ForceOpaqueOn();
      renderer->AddActor(actor);
    }
    renderer->SetPass(pass);
  }

  double Scale() const { return quality.pixel_scale * quality.samples; }
  void ShowShadow(const MapSnapshot& map);
  PictureEffects Effects() const;

  SceneStyle style;
  Quality quality;
  SceneFocus focus;
  vtkNew<vtkOpenGLRenderer> renderer;
  vtkNew<PicturePass> pass;
  Studio studio;
  vtkSmartPointer<vtkActor> grid;
  vtkSmartPointer<vtkActor> shadow;
  PointActors points;
  PointActors object_points;
  vtkSmartPointer<vtkActor> trajectory;
  vtkSmartPointer<vtkActor> frusta;
  vtkSmartPointer<vtkActor> current;
  SolidActors solids;
};

void Scene::Impl::ShowShadow(const MapSnapshot& map) {
  shadow->SetVisibility(false);
  if (style.light.shadow <= 0.0 || !style.objects.show) {
    return;
  }
  std::vector<PosedSuperquadric> casting;
  for (const SnapshotObject& object : map.objects) {
    const Eigen::Vector3d offset = object.superquadric.T_map_object.translation - focus.center;
    if (offset.norm() < 3.0 * focus.radius) {  // one stray object would cost all others their sharpness
      casting.push_back(object.superquadric);
    }
  }
  ShadowLight light;
  light.towards = studio.Lamp();
  const GroundShadow cast = CastGroundShadow(casting, focus.up, focus.ground_height, light);
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
  s.studio = {focus.up, focus.front};
  s.ShowShadow(map);
  s.solids.Show(map.objects, colors);
  s.pass->SetEffects(s.Effects());
}

void Scene::LookFrom(const ViewCamera& view, int height) {
  Impl& s = *impl_;
  PictureLayers layers;
  const auto add = [](const vtkSmartPointer<vtkActor>& actor, std::vector<vtkProp*>& layer) {
    if (actor->GetVisibility() != 0) {
      layer.push_back(actor);
    }
  };
  const double samples = height * s.quality.samples;
  if (s.style.points.show) {
    for (const PointActors* points : {&s.points, &s.object_points}) {
      for (vtkActor* actor : points->Arrange(view, samples)) {
        layers.opaque.push_back(actor);
      }
    }
  }
  for (const auto& actor : {s.trajectory, s.frusta, s.current}) {
    add(actor, layers.opaque);
  }
  for (const auto& actor : {s.shadow, s.grid}) {
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
