#include "render/scene/scene.h"

#include <vtkCamera.h>
#include <vtkLight.h>
#include <vtkPointData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkShaderProperty.h>
#include <vtkTexture.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "picture_shaders.h"
#include "render/gl/offscreen_window.h"
#include "render/scene/color_scale.h"
#include "render/scene/object_look.h"
#include "render/scene/scene_geometry.h"
#include "render/solids/ground_shadow.h"
#include "render/solids/poly_data.h"

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

// Returns area-weighted vertex normals.
std::vector<Eigen::Vector3f> NormalsOf(const SurfaceMesh& mesh) {
  std::vector<Eigen::Vector3f> normals(mesh.vertices.size(), Eigen::Vector3f::Zero());
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3f twice_area =
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    for (const std::uint32_t corner : {a, b, c}) {
      normals[corner] += twice_area;
    }
  }
  for (Eigen::Vector3f& normal : normals) {
    normal.normalize();
  }
  return normals;
}

vtkSmartPointer<vtkPolyData> Geometry(const SurfaceMesh& mesh) {
  auto data = PolyDataOf(mesh.vertices, mesh.triangles);
  data->GetPointData()->SetScalars(TuplesOf<vtkUnsignedCharArray>(mesh.rgb));
  data->GetPointData()->SetNormals(TuplesOf<vtkFloatArray>(NormalsOf(mesh)));
  return data;
}

// Makes an actor for a mesh with colours from photographs, which already contain the room's light: a lamp
// over the viewer's shoulder adds just enough shading to distinguish surfaces. Back faces are culled, such as
// a wall between the viewer and the room.
vtkSmartPointer<vtkActor> MakeMeshActor(const SurfaceMesh& mesh, vtkPlaneCollection* clip) {
  const vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(Geometry(mesh));
  mapper->SetClippingPlanes(clip);
  auto actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  actor->ForceOpaqueOn();
  actor->GetProperty()->BackfaceCullingOn();
  actor->GetShaderProperty()->AddFragmentShaderReplacement("//VTK::Light::Impl", true, shaders::kPhotographed,
                                                           false);
  return actor;
}

// Shows only the triangles of that mesh whose corners have all been seen by this frame.
void ShowTrianglesUntil(std::int64_t frame, const SurfaceMesh& mesh, vtkActor& actor) {
  vtkPolyData* data = vtkPolyDataMapper::SafeDownCast(actor.GetMapper())->GetInput();
  const vtkNew<vtkCellArray> triangles;
  for (const auto& [a, b, c] : mesh.triangles) {
    if (mesh.frames[a] <= frame && mesh.frames[b] <= frame && mesh.frames[c] <= frame) {
      triangles->InsertNextCell({a, b, c});
    }
  }
  actor.SetVisibility(triangles->GetNumberOfCells() > 0);
  data->SetPolys(triangles);
}

void AddIfVisible(vtkActor* actor, std::vector<vtkActor*>& layer) {
  if (actor->GetVisibility() != 0) {
    layer.push_back(actor);
  }
}

void PlaceCamera(const ViewCamera& view, double near_plane, double far_plane, vtkCamera* camera) {
  camera->SetPosition(view.position.data());
  camera->SetFocalPoint(view.focal_point.data());
  camera->SetViewUp(view.view_up.data());
  camera->SetViewAngle(view.view_angle);
  camera->SetParallelProjection(view.IsOrthographic());
  camera->SetParallelScale(0.5 * view.PictureHeight());
  camera->SetClippingRange(near_plane, far_plane);
  camera->UseExplicitProjectionTransformMatrixOff();
  if (view.pinhole) {
    SetPinholeCamera(*view.pinhole, PoseOf(view), near_plane, far_plane, camera);
  }
}

// Moves an orthographic view along its line of sight until the nearest point of the scene is as far away as
// the scene is large. This does not change the picture.
ViewCamera MovedBack(const ViewCamera& view, const SceneFocus& focus) {
  const Eigen::Vector3d back = AxesOf(view).back;
  double nearest = focus.center.dot(back);
  for (const Eigen::Vector3d& p : focus.outline) {
    nearest = std::max(nearest, p.dot(back));
  }
  const Eigen::Vector3d shift = (nearest + focus.radius - view.position.dot(back)) * back;
  ViewCamera moved = view;
  moved.position += shift;
  moved.focal_point += shift;
  return moved;
}

}  // namespace

Scene::Scene(const SceneStyle& style, const Quality& quality)
    : style_(style),
      quality_(quality),
      grid_(MakeActor(style.grid.width * Scale())),
      shadow_(MakeActor(1.0)),
      covisibility_(MakeActor(style.covisibility.width * Scale())),
      true_path_(MakeActor(style.ground_truth.width * Scale())),
      true_objects_(MakeActor(0.75 * style.ground_truth.width * Scale())),
      trajectory_(MakeActor(style.cameras.width * Scale())),
      frusta_(MakeActor(style.cameras.keyframe_width * Scale())),
      current_(MakeActor(2.0 * style.cameras.keyframe_width * Scale())),
      uncertain_(MakeActor(style.cameras.keyframe_width * Scale())),
      solids_(style.objects, clip_planes_) {
  renderer_->AutomaticLightCreationOff();
  renderer_->AddLight(vtkNew<vtkLight>());  // unused: solids have their own shading, all else is unlit
  for (const auto& actor : {grid_, shadow_, covisibility_}) {
    actor->ForceTranslucentOn();
    renderer_->AddActor(actor);
  }
  for (const auto& actor : {true_path_, true_objects_, trajectory_, frusta_, current_, uncertain_}) {
    actor->ForceOpaqueOn();
    renderer_->AddActor(actor);
  }
  renderer_->SetPass(pass_);
}

Scene::~Scene() { pass_->SetLayers({}); }  // the window's renderer keeps the pass

void Scene::SetClipPlane(const std::optional<ClipPlane>& plane) {
  if (!plane) {
    clip_planes_->RemoveAllItems();
    return;
  }
  const Eigen::Vector3d at = plane->height * plane->normal;
  const Eigen::Vector3d kept = -plane->normal;  // VTK keeps the side that the normal points to
  clip_plane_->SetOrigin(at.data());
  clip_plane_->SetNormal(kept.data());
  if (clip_planes_->GetNumberOfItems() == 0) {
    clip_planes_->AddItem(clip_plane_);
  }
}

// Updates the shadow of the solids that are not cut away, if they, the ground or the lamp have changed.
void Scene::CastShadow(const std::optional<ClipPlane>& plane) {
  std::vector<PosedSuperquadric> casters;
  ShadowLight light;
  light.towards = studio_.Lamp();
  std::vector<double> shadow_inputs = {focus_.up.x(),       focus_.up.y(),     focus_.up.z(),
                                       light.towards.x(),   light.towards.y(), light.towards.z(),
                                       focus_.ground_height};
  for (const SnapshotObject& object : solid_objects_) {
    const Eigen::Vector3d offset = object.superquadric.T_map_object.translation - focus_.center;
    // Glass casts none. A distant outlier would cost all other shadows their resolution.
    if (LookOf(object, style_.objects, false) != ObjectLook::kSolid || offset.norm() >= 3.0 * focus_.radius) {
      continue;
    }
    for (const PosedSuperquadric& solid : DrawnSolids(object, style_.objects)) {
      if (!plane || plane->KeepsSomeOf(solid)) {
        casters.push_back(solid);
        const SuperquadricParameters parameters = ToParameters(solid);
        shadow_inputs.insert(shadow_inputs.end(), parameters.begin(), parameters.end());
      }
    }
  }
  if (std::exchange(shadow_inputs_, shadow_inputs) != shadow_inputs) {
    if (quality_.draft) {
      light.lamp_samples = light.sky_samples = 8;
    }
    const GroundShadow shadow = CastGroundShadow(casters, focus_.up, focus_.ground_height, light);
    shadow_->SetTexture(nullptr);
    if (!shadow.darkness.empty()) {
      SetGeometry(shadow_, ShadowQuad(shadow), true);
      shadow_->SetTexture(ShadowTexture(shadow, style_.light.shadow, ParseColor(style_.background)));
    }
  }
  shadow_->SetVisibility(shadow_->GetTexture() != nullptr);
}

PictureEffects Scene::Effects() const {
  PictureEffects effects;
  effects.samples = quality_.samples;
  effects.fxaa = quality_.fxaa;
  effects.occlusion = style_.light.ambient_occlusion;
  effects.occlusion_radius = style_.light.occlusion_radius * focus_.radius;
  effects.line_widths =
      quality_.pixel_scale * Eigen::Vector2d(style_.light.outline_width, style_.objects.line_width);
  effects.eye_dome = style_.light.eye_dome;
  if (solids_.SeeThrough()) {
    effects.see_through = true;
    effects.occlusion = 0.0;
  }
  if (quality_.transparent) {
    effects.background.setZero();
  } else {
    effects.background << ParseColor(style_.background), 1.0;
  }
  effects.has_ground = style_.light.shadow > 0.0;
  effects.ground_plane << focus_.up, -focus_.ground_height;
  return effects;
}

void Scene::Show(const MapSnapshot& map, const SceneFocus& focus, const LabelColors& colors) {
  focus_ = focus;
  const SceneStyle& style = style_;
  SetGeometry(grid_, GroundGrid(focus, style), style.grid.show);
  points_.SetVertices(MapPoints(map, style, Scale()));
  frame_ = map.frame_index;
  GrowMesh();
  const double keyframe = KeyframeFrustumHeight(focus, style.cameras.size);
  const double current = CurrentFrustumHeight(focus, style.cameras.size);
  SetGeometry(trajectory_, TrajectoryLine(map, truth_.get(), style), style.cameras.trajectory);
  SetGeometry(frusta_, KeyframeFrusta(map, keyframe, style), style.cameras.keyframes);
  SetGeometry(current_, CurrentFrustum(map, current, style), style.cameras.current);
  SetGeometry(covisibility_, CovisibilityLines(map, style), style.covisibility.show);
  studio_ = {focus.up, focus.front};
  solid_objects_.clear();
  colors_ = colors;
  const bool all = style.objects.uncertain == UncertainObjects::kSolid;
  std::ranges::copy_if(map.objects, std::back_inserter(solid_objects_),
                       [all](const SnapshotObject& object) { return all || IsReliable(object); });
  SetGeometry(uncertain_,
              UncertainOutlines(
                  map, [this](const SnapshotObject& object) { return ColorOf(object); }, style),
              style.objects.show && style.objects.uncertain == UncertainObjects::kOutline);
  ShowSolids();
}

Eigen::Vector3d Scene::ColorOf(const SnapshotObject& object) const {
  const bool scored = truth_ && truth_->iou.contains(object.id);
  return scored ? Viridis(truth_->iou.at(object.id)) : colors_(object.label);
}

void Scene::ShowSolids() {
  solids_.Show(
      solid_objects_, [this](const SnapshotObject& object) { return ColorOf(object); }, IsDense());
}

void Scene::SetLayers(const SceneLayers& layers) {
  SetGeometry(true_path_, PathLines(layers.true_path, ParseColor(style_.ground_truth.color)),
              style_.ground_truth.show);
  truth_ = style_.ground_truth.show ? layers.truth : nullptr;
  SetGeometry(true_objects_, TrueOutlines(truth_ ? truth_->solids : std::vector<PosedSuperquadric>(), style_),
              true);
  if (shown_cloud_ != layers.dense_cloud || shown_mesh_ != layers.dense_mesh) {
    shown_cloud_ = layers.dense_cloud;
    shown_mesh_ = layers.dense_mesh;
    ShowMesh();
    cloud_.Show(HasCloud() ? shown_cloud_ : nullptr);
    ShowSolids();
  }
}

void Scene::ShowMesh() {
  if (mesh_) {
    renderer_->RemoveActor(mesh_);
    mesh_ = nullptr;
  }
  if (shown_mesh_ && style_.dense_cloud.look == DenseLook::kMesh) {
    mesh_ = MakeMeshActor(*shown_mesh_, clip_planes_);
    renderer_->AddActor(mesh_);
    mesh_frames_ = {shown_mesh_->frames.begin(), shown_mesh_->frames.end()};
    mesh_shown_until_.reset();
    GrowMesh();
  }
}

void Scene::GrowMesh() {
  if (!mesh_ || shown_mesh_->frames.empty()) {
    return;
  }
  // Nothing appears between two depth maps.
  const auto last = mesh_frames_.upper_bound(frame_);
  const std::int64_t until = last == mesh_frames_.begin() ? -1 : *std::prev(last);
  if (mesh_shown_until_ != until) {
    ShowTrianglesUntil(until, *shown_mesh_, *mesh_);
    mesh_shown_until_ = until;
  }
}

void Scene::ArrangePoints(const ViewCamera& view, cv::Size size, const std::optional<ClipPlane>& clip,
                          PictureLayers& layers) {
  PointSplats::Look look;
  if (clip) {
    look.cut << clip->normal.cast<float>(), static_cast<float>(clip->height);
  }
  if (style_.points.show && (!IsDense() || style_.dense_cloud.points)) {
    points_.SetLook(look);
    layers.points.push_back(&points_);
  }
  if (HasCloud()) {
    const double samples = quality_.samples;
    cloud_.LookFrom(FromAfar(view), samples * size.height, static_cast<double>(size.width) / size.height,
                    samples * style_.dense_cloud.detail, frame_);
    look.in_map_units = true;
    look.scale = static_cast<float>(style_.dense_cloud.size);
    look.newest = static_cast<float>(frame_);
    cloud_.Splats().SetLook(look);
    layers.points.push_back(&cloud_.Splats());
  }
}

// Lines over dense surfaces are blended without writing depth: eye-dome lighting would give them black rims.
void Scene::ArrangeLines(PictureLayers& layers) {
  const bool over_dense = IsDense();
  frusta_->GetProperty()->SetOpacity(over_dense ? 0.5 : 1.0);
  for (const auto& actor : {uncertain_, true_objects_, frusta_, true_path_, trajectory_, current_}) {
    actor->SetForceTranslucent(over_dense);
    actor->SetForceOpaque(!over_dense);
    AddIfVisible(actor, over_dense ? layers.ground : layers.opaque);
  }
}

// Returns the lines around solids: in the colour of the class around glass.
std::vector<Eigen::Vector4d> Scene::Lines() const {
  const Eigen::Vector3d paper = ParseColor(style_.background);
  const Eigen::Vector3d ink = ParseColor(style_.light.outline_color);
  std::vector<Eigen::Vector4d> lines;
  double strongest = 0.0;
  for (const auto& [color, look] : solids_.Looks()) {
    const bool solid = look == ObjectLook::kSolid;
    lines.emplace_back();
    lines.back() << (solid ? ink : ReadableOn(paper, color, style_.points.min_contrast)),
        solid ? style_.light.outline : style_.objects.line;
    strongest = std::max(strongest, lines.back().w());
  }
  return strongest > 0.0 ? lines : std::vector<Eigen::Vector4d>();
}

void Scene::LookFrom(const ViewCamera& wanted, cv::Size size) {
  const ViewCamera view = wanted.IsOrthographic() ? MovedBack(wanted, focus_) : wanted;
  const std::optional<ClipPlane> clip = MakeClipPlane(style_.clip, focus_, view);
  SetClipPlane(clip);
  if (style_.light.shadow > 0.0 && style_.objects.show && !solids_.SeeThrough()) {
    CastShadow(clip);
  } else {
    shadow_->SetVisibility(false);
  }
  PictureLayers layers;
  ArrangePoints(view, size, clip, layers);
  for (const auto& actor : {shadow_, grid_, covisibility_}) {
    AddIfVisible(actor, layers.ground);
  }
  if (HasMesh()) {
    AddIfVisible(mesh_, layers.opaque);
  }
  ArrangeLines(layers);
  // Based on the focus, not on the bounds of all points: one outlier would cost the depth buffer its
  // precision.
  const double distance = (view.position - focus_.center).norm();
  const double nearest = 0.01 * (distance + focus_.radius);
  const double farthest = 1200.0 * nearest;
  // Points of a dense cloud on a solid's surface must be visible in it despite their depth error.
  constexpr double kDepthError = 0.02;  // relative to the distance from which they were seen
  const double nearer = kDepthError * std::min(1.0, focus_.view_depth / std::max(distance, 1e-9));
  SolidActors::Surroundings around;
  around.studio = studio_;
  const double first = 5.0 * nearest;  // solids are rarely nearer than this, or farther than 80 times this
  const double steps = std::log2(80.0);
  around.range = Eigen::Vector3d(first, 1.0 / steps, 1.0 - nearer - 0.5 * steps / 255.0).cast<float>();
  around.parallel = view.IsOrthographic();
  around.nearer = static_cast<float>(2.0 * (around.parallel ? distance : farthest * nearest) /
                                     (farthest - nearest) * nearer);
  layers.solids = solids_.Arrange(FromAfar(view), size.height * quality_.samples, around);
  PictureEffects effects = Effects();
  effects.surface_range = around.range;
  pass_->SetEffects(effects);
  layers.lines = Lines();
  pass_->SetLayers(std::move(layers));
  PlaceCamera(view, nearest, farthest, renderer_->GetActiveCamera());
}

}  // namespace sqslam
