#include "render/scene/solid_actors.h"

#include <vtkActor.h>
#include <vtkDataObject.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkShaderProperty.h>
#include <vtkUniforms.h>

#include <algorithm>
#include <cmath>

#include "render/gl/picture_shaders.h"
#include "render/scene/scene_geometry.h"
#include "render/scene/studio_light.h"

namespace sqslam {
namespace {

constexpr int kGroupSegments = 48;  // of solids that are sorted by triangles: the seams show its steps

vtkSmartPointer<vtkActor> MakeActor(const SceneStyle::Objects& style, vtkPlaneCollection* clip) {
  const vtkNew<vtkPolyDataMapper> mapper;
  const auto actor = vtkSmartPointer<vtkActor>::New();
  mapper->SetClippingPlanes(clip);
  actor->SetMapper(mapper);
  actor->SetUserMatrix(vtkNew<vtkMatrix4x4>());
  vtkProperty* property = actor->GetProperty();
  property->SetOpacity(style.opacity);
  actor->ForceOpaqueOn();  // blended all the same, but writes depth, which the picture's effects need
  return actor;
}

vtkPolyDataMapper* MapperOf(vtkActor* actor) { return vtkPolyDataMapper::SafeDownCast(actor->GetMapper()); }

struct SolidShading {
  int number = 0;                      // 1, 2, ...: what outlines tell apart
  const char* number_array = nullptr;  // instead of `number`: a data array of the vertices
  bool far_side = false;               // seen through the near side only
  double roughness = 0.5;
  double metallic = 0.0;
};

void SetSolidShader(vtkActor* actor, const SolidShading& shading) {
  static const std::string kStudio = StudioShader();
  auto* shader = actor->GetShaderProperty();
  shader->ClearAllShaderReplacements();
  // "before VTK's own replacements", so that VTK does not write its light there.
  shader->AddFragmentShaderReplacement("//VTK::Light::Dec", true,
                                       (shading.far_side ? "#define FAR_SIDE\n" : "") + kStudio, false);
  shader->AddFragmentShaderReplacement("//VTK::Light::Impl", true,
                                       std::string(shaders::kLight) + shaders::kSurfaceOutput, false);
  auto* uniforms = shader->GetFragmentCustomUniforms();
  uniforms->SetUniformf("roughness", static_cast<float>(shading.roughness));
  uniforms->SetUniformf("metallic", static_cast<float>(shading.metallic));
  if (shading.number_array == nullptr) {
    uniforms->SetUniformf("solidNumber", static_cast<float>(shading.number));
    return;
  }
  shader->AddVertexShaderReplacement("//VTK::Normal::Dec", true, shaders::kNumberVertexDeclaration, false);
  shader->AddVertexShaderReplacement("//VTK::Normal::Impl", true, shaders::kNumberVertex, false);
  shader->AddFragmentShaderReplacement("//VTK::Normal::Dec", true, shaders::kNumberFragmentDeclaration,
                                       false);
  vtkPolyDataMapper::SafeDownCast(actor->GetMapper())
      ->MapDataArrayToVertexAttribute("solidNumberMC", shading.number_array,
                                      vtkDataObject::FIELD_ASSOCIATION_POINTS);
}

// Directions of the studio seen from the camera (x right, y up, z towards the viewer); for each view.
struct StudioInView {
  Eigen::Vector3d up, lamp, window;
};

void SetStudio(vtkActor* actor, const StudioInView& studio) {
  const auto set = [uniforms = actor->GetShaderProperty()->GetFragmentCustomUniforms()](
                       const char* name, const Eigen::Vector3d& direction) {
    const Eigen::Vector3f value = direction.cast<float>();
    uniforms->SetUniform3f(name, value.data());
  };
  set("roomUp", studio.up);
  set("roomLamp", studio.lamp);
  set("roomWindow", studio.window);
}

bool SameShape(const Superquadric& a, const Superquadric& b) {
  return a.half_size == b.half_size && a.e1 == b.e1 && a.e2 == b.e2;
}

}  // namespace

void SolidActors::Show(const std::vector<SnapshotObject>& objects, const LabelColors& colors) {
  solids_.resize(objects.size());
  groups_.clear();
  std::vector<PosedSuperquadric> posed;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    Solid& solid = solids_[i];
    if (!solid.front) {
      solid.back = MakeActor(style_, clip_);
      solid.front = MakeActor(style_, clip_);
      for (vtkActor* actor : {solid.back.Get(), solid.front.Get()}) {
        MapperOf(actor)->ScalarVisibilityOff();
      }
      SolidShading shading;
      shading.number = static_cast<int>(i) + 1;
      shading.roughness = style_.roughness;
      shading.metallic = style_.metallic;
      SetSolidShader(solid.front, shading);
      shading.far_side = true;
      SetSolidShader(solid.back, shading);
      solid.back->GetProperty()->FrontfaceCullingOn();
      solid.front->GetProperty()->BackfaceCullingOn();
    }
    if (!SameShape(solid.posed.shape, objects[i].superquadric.shape)) {
      solid.segments = 0;
    }
    solid.posed = objects[i].superquadric;
    solid.color = colors(objects[i].label);
    posed.push_back(solid.posed);
    const Eigen::Matrix4d pose = solid.posed.T_map_object.Matrix();
    for (vtkActor* actor : {solid.back.Get(), solid.front.Get()}) {
      for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 4; ++column) {
          actor->GetUserMatrix()->SetElement(row, column, pose(row, column));
        }
      }
      actor->GetProperty()->SetColor(solid.color.x(), solid.color.y(), solid.color.z());
    }
  }
  order_ = style_.opacity < 1.0 ? SolidOrder(std::move(posed)) : SolidOrder();
}

int SolidActors::SegmentsFor(const PosedSuperquadric& solid, const ViewCamera& camera, double pixels) const {
  // A chord of n segments misses the curve by at most 5 / n^2 of the half axis at the exponents in use: a
  // fifth of a sample is not seen.
  constexpr double kLeastError = 0.2;
  const double distance =
      std::max((solid.T_map_object.translation - camera.position).norm() - solid.shape.half_size.maxCoeff(),
               0.1 * solid.shape.half_size.maxCoeff());
  const double focal = camera.FocalLength(pixels);
  const double radius = focal * solid.shape.half_size.maxCoeff() / distance;
  const double wanted = std::sqrt(5.0 * radius / kLeastError);
  for (const int segments : {16, 24, 32, 48, 64, 96}) {
    if (wanted <= segments || segments >= style_.segments) {
      return std::min(segments, style_.segments);
    }
  }
  return std::min(128, style_.segments);
}

void SolidActors::SetDetail(Solid& solid, int segments) {
  if (solid.segments == segments) {
    return;
  }
  solid.segments = segments;
  const auto mesh = SuperquadricMesh(solid.posed.shape, segments);
  MapperOf(solid.back)->SetInputData(mesh);
  MapperOf(solid.front)->SetInputData(mesh);
}

SolidActors::Group& SolidActors::GroupOf(const std::vector<int>& members) {
  std::vector<int> sorted = members;
  std::sort(sorted.begin(), sorted.end());
  Group& group = groups_[sorted];
  if (group.actor) {
    return group;
  }
  std::vector<ColoredSolid> parts;
  for (const int index : sorted) {
    const Solid& solid = solids_[static_cast<std::size_t>(index)];
    parts.push_back({solid.posed, solid.color, index + 1});
  }
  group.surface = MakeGroupedSurface(parts, std::min(kGroupSegments, std::max(style_.segments, 16)));
  group.actor = MakeActor(style_, clip_);
  MapperOf(group.actor)->SetInputData(group.surface.mesh);
  SolidShading shading;
  shading.number_array = kSolidNumberArray;
  shading.roughness = style_.roughness;
  shading.metallic = style_.metallic;
  SetSolidShader(group.actor, shading);
  return group;
}

std::vector<vtkActor*> SolidActors::Arrange(const ViewCamera& camera, double pixels, const Studio& studio) {
  std::vector<vtkActor*> actors = InOrder(camera, pixels);
  const ViewAxes axes = AxesOf(camera);
  const auto in_view = [&axes](const Eigen::Vector3d& d) {
    return Eigen::Vector3d(d.dot(axes.right), d.dot(axes.up), d.dot(axes.back));
  };
  const StudioInView seen = {in_view(studio.up), in_view(studio.Lamp()), in_view(studio.Window())};
  for (vtkActor* actor : actors) {
    SetStudio(actor, seen);
  }
  return actors;
}

std::vector<vtkActor*> SolidActors::InOrder(const ViewCamera& camera, double pixels) {
  std::vector<vtkActor*> actors;
  if (!style_.show || style_.opacity <= 0.0) {
    return actors;
  }
  if (style_.opacity >= 1.0) {
    const bool open = clip_->GetNumberOfItems() > 0;  // one looks into what is cut
    for (Solid& solid : solids_) {
      SetDetail(solid, SegmentsFor(solid.posed, camera, pixels));
      if (open) {
        actors.push_back(solid.back);
      }
      actors.push_back(solid.front);
    }
    return actors;
  }
  for (const std::vector<int>& members : order_.BackToFront(camera.position)) {
    if (members.size() == 1) {
      Solid& solid = solids_[static_cast<std::size_t>(members.front())];
      SetDetail(solid, SegmentsFor(solid.posed, camera, pixels));
      actors.push_back(solid.back);
      actors.push_back(solid.front);
    } else {
      Group& group = GroupOf(members);
      SortTriangles(group.surface, camera.position);
      actors.push_back(group.actor);
    }
  }
  return actors;
}

}  // namespace sqslam
