#include "render/scene.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkLight.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkOpenGLRenderer.h>
#include <vtkPolyDataMapper.h>
#include <vtkPropCollection.h>
#include <vtkProperty.h>

#include <algorithm>

#include "render/scene_geometry.h"
#include "render/scene_order.h"

namespace sqslam {
namespace {

// Draws translucent props one after the other as they stand in the list, plainly blended. VTK's own ways are
// an approximation (weighted blending) or four times slower (depth peeling); with convex surfaces in order
// neither is needed.
class OrderedRenderer : public vtkOpenGLRenderer {
 public:
  static OrderedRenderer* New() {
    auto* renderer = new OrderedRenderer;
    renderer->InitializeObjectBase();
    return renderer;
  }
  void DeviceRenderTranslucentPolygonalGeometry(vtkFrameBufferObjectBase*) override {
    this->UpdateTranslucentPolygonalGeometry();
  }
};

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

// One superquadric: its far side and its near side, so that both blend in the right order.
struct SolidActors {
  vtkSmartPointer<vtkActor> back = vtkSmartPointer<vtkActor>::New();
  vtkSmartPointer<vtkActor> front = vtkSmartPointer<vtkActor>::New();

  SolidActors() {
    for (const auto& actor : {back, front}) {
      const vtkNew<vtkPolyDataMapper> mapper;
      mapper->ScalarVisibilityOff();
      actor->SetMapper(mapper);
      actor->SetUserMatrix(vtkNew<vtkMatrix4x4>());
    }
    back->GetProperty()->FrontfaceCullingOn();
    front->GetProperty()->BackfaceCullingOn();
  }

  void Set(const PosedSuperquadric& solid, const Eigen::Vector3d& color, const SceneStyle::Objects& style) {
    const auto mesh = SuperquadricMesh(solid.shape, style.segments);
    const Eigen::Matrix4d pose = solid.T_map_object.Matrix();
    for (const auto& actor : {back, front}) {
      vtkPolyDataMapper::SafeDownCast(actor->GetMapper())->SetInputData(mesh);
      for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 4; ++column) {
          actor->GetUserMatrix()->SetElement(row, column, pose(row, column));
        }
      }
      vtkProperty* property = actor->GetProperty();
      property->SetColor(color.x(), color.y(), color.z());
      property->SetAmbient(0.36);
      property->SetDiffuse(0.68);
      property->SetSpecular(style.gloss);
      property->SetSpecularPower(25.0);
      property->SetOpacity(style.opacity);
    }
    back->SetVisibility(style.show && style.opacity < 1.0);
    front->SetVisibility(style.show && style.opacity > 0.0);
  }
};

void AddLight(vtkRenderer* renderer, double x, double y, double z, double intensity) {
  const vtkNew<vtkLight> light;
  light->SetLightTypeToCameraLight();  // moves with the camera: position in its frame, y up, z towards it
  light->SetPosition(x, y, z);
  light->SetFocalPoint(0.0, 0.0, 0.0);
  light->SetIntensity(intensity);
  renderer->AddLight(light);
}

}  // namespace

struct Scene::Impl {
  Impl(const SceneStyle& wanted, double pixel_scale)
      : style(wanted),
        grid(MakeActor(style.grid.width * pixel_scale)),
        points(MakeActor(style.points.size * pixel_scale)),
        object_points(MakeActor(style.points.object_size * pixel_scale)),
        trajectory(MakeActor(style.cameras.width * pixel_scale)),
        frusta(MakeActor(style.cameras.keyframe_width * pixel_scale)),
        current(MakeActor(2.0 * style.cameras.keyframe_width * pixel_scale)) {
    renderer->AutomaticLightCreationOff();
    renderer->TwoSidedLightingOn();
    AddLight(renderer, -0.5, 1.0, 0.7, 0.6);
    AddLight(renderer, 0.3, 0.1, 1.0, 0.5);
    for (const auto& actor : {points, object_points, trajectory, frusta, current, grid}) {
      renderer->AddActor(actor);
    }
    grid->ForceTranslucentOn();
    for (const auto& actor : {points, object_points, trajectory, frusta, current}) {
      actor->ForceOpaqueOn();
    }
    points->GetProperty()->RenderPointsAsSpheresOn();
    object_points->GetProperty()->RenderPointsAsSpheresOn();
    SetBackground(false);
  }

  void SetBackground(bool transparent) {
    const Eigen::Vector3d color = transparent ? Eigen::Vector3d::Zero() : ParseColor(style.background);
    renderer->SetBackground(color.data());
    renderer->SetBackgroundAlpha(transparent ? 0.0 : 1.0);
  }

  // Puts the solids behind everything else in the list of props, farthest first. The list is changed
  // directly: the renderer's own removal would throw the buffers on the graphics device away.
  void OrderSolids(const Eigen::Vector3d& eye) {
    vtkPropCollection* props = renderer->GetViewProps();
    for (std::size_t i = 0; i < solids.size(); ++i) {
      props->RemoveItem(solids[i].back);
      props->RemoveItem(solids[i].front);
    }
    for (const int index : BackToFront(shapes, eye)) {
      props->AddItem(solids[static_cast<std::size_t>(index)].back);
      props->AddItem(solids[static_cast<std::size_t>(index)].front);
    }
    renderer->Modified();
  }

  SceneStyle style;
  SceneFocus focus;
  vtkNew<OrderedRenderer> renderer;
  vtkSmartPointer<vtkActor> grid;
  vtkSmartPointer<vtkActor> points;
  vtkSmartPointer<vtkActor> object_points;
  vtkSmartPointer<vtkActor> trajectory;
  vtkSmartPointer<vtkActor> frusta;
  vtkSmartPointer<vtkActor> current;
  std::vector<SolidActors> solids;
  std::vector<PosedSuperquadric> shapes;  // of the solids
};

Scene::Scene(const SceneStyle& style, double pixel_scale)
    : impl_(std::make_unique<Impl>(style, pixel_scale)) {}
Scene::~Scene() = default;

vtkRenderer* Scene::Renderer() const { return impl_->renderer; }
void Scene::SetTransparent(bool transparent) { impl_->SetBackground(transparent); }
void Scene::SetSmoothEdges(bool fxaa) { impl_->renderer->SetUseFXAA(fxaa); }

void Scene::Show(const MapSnapshot& map, const SceneFocus& focus, const LabelColors& colors) {
  Impl& s = *impl_;
  s.focus = focus;
  const SceneStyle& style = s.style;
  SetGeometry(s.grid, GroundGrid(focus, style), style.grid.show);
  SetGeometry(s.points, PointCloud(map, false, style), style.points.show);
  SetGeometry(s.object_points, PointCloud(map, true, style), style.points.show);
  const double frustum = 2.0 * style.cameras.size * std::min(focus.radius, focus.view_depth);
  SetGeometry(s.trajectory, TrajectoryLine(map, style), style.cameras.trajectory);
  SetGeometry(s.frusta, KeyframeFrusta(map, frustum, style), style.cameras.keyframes);
  SetGeometry(s.current, CurrentFrustum(map, 1.6 * frustum, style), style.cameras.current);
  while (s.solids.size() > map.objects.size()) {
    s.renderer->RemoveActor(s.solids.back().back);
    s.renderer->RemoveActor(s.solids.back().front);
    s.solids.pop_back();
  }
  while (s.solids.size() < map.objects.size()) {
    SolidActors& solid = s.solids.emplace_back();
    s.renderer->AddActor(solid.back);
    s.renderer->AddActor(solid.front);
  }
  s.shapes.clear();
  for (std::size_t i = 0; i < s.solids.size(); ++i) {
    const SnapshotObject& object = map.objects[i];
    s.solids[i].Set(object.superquadric, colors(object.label), style.objects);
    s.shapes.push_back(object.superquadric);
  }
}

void Scene::LookFrom(const ViewCamera& view) {
  Impl& s = *impl_;
  s.OrderSolids(view.position);
  vtkCamera* camera = s.renderer->GetActiveCamera();
  camera->SetPosition(view.position.data());
  camera->SetFocalPoint(view.focal_point.data());
  camera->SetViewUp(view.view_up.data());
  camera->SetViewAngle(view.view_angle);
  // From what the picture is about, not from the bounds of all points: one stray point would cost the depth
  // buffer its precision.
  const double reach = (view.position - s.focus.center).norm() + s.focus.radius;
  camera->SetClippingRange(0.01 * reach, 12.0 * reach);
}

}  // namespace sqslam
