#include "render/scene/solid_actors.h"

#include <vtkActor.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkShaderProperty.h>
#include <vtkUniforms.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "picture_shaders.h"
#include "render/scene/studio_light.h"
#include "render/solids/poly_data.h"
#include "render/solids/tessellation.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

vtkSmartPointer<vtkActor> MakeActor(bool see_through, vtkPlaneCollection* clip) {
  const vtkNew<vtkPolyDataMapper> mapper;
  const auto actor = vtkSmartPointer<vtkActor>::New();
  mapper->SetClippingPlanes(clip);
  actor->SetMapper(mapper);
  actor->SetUserMatrix(vtkNew<vtkMatrix4x4>());
  if (see_through) {
    actor->ForceTranslucentOn();
  } else {
    actor->ForceOpaqueOn();  // still blended, but writes depth, which the picture's effects need
  }
  return actor;
}

vtkPolyDataMapper* MapperOf(vtkActor* actor) { return vtkPolyDataMapper::SafeDownCast(actor->GetMapper()); }

// Returns the superquadric's surface (Eq. 1) in the object frame.
vtkSmartPointer<vtkPolyData> SuperquadricMesh(const Superquadric& shape, int segments) {
  const TriangleMesh surface = Tessellate(shape, segments / 4 * 4);
  auto mesh = PolyDataOf(surface.vertices, surface.triangles);
  mesh->GetPointData()->SetNormals(TuplesOf<vtkFloatArray>(surface.normals));
  return mesh;
}

struct SolidShading {
  const SceneStyle::Objects& style;
  int number = 0;         // 1, 2, ...; separates solids for outlines
  bool far_side = false;  // only seen through the near side
  bool see_through = false;
};

void SetSolidShader(vtkActor* actor, const SolidShading& shading) {
  static const std::string kStudio = StudioShader();
  auto* shader = actor->GetShaderProperty();
  shader->ClearAllShaderReplacements();
  // `true`: before VTK's own replacements, which would insert VTK's lighting there.
  shader->AddFragmentShaderReplacement("//VTK::Light::Dec", true,
                                       std::string(shading.far_side ? "#define FAR_SIDE\n" : "") +
                                           (shading.see_through ? "#define SEE_THROUGH\n" : "") + kStudio,
                                       false);
  shader->AddFragmentShaderReplacement("//VTK::Light::Impl", true,
                                       std::string(shaders::kLight) + shaders::kSurfaceOutput, false);
  if (shading.see_through) {
    shader->AddVertexShaderReplacement("//VTK::PositionVC::Impl", true, shaders::kNearer, false);
  }
  auto* uniforms = shader->GetFragmentCustomUniforms();
  uniforms->SetUniformf("roughness", static_cast<float>(shading.style.roughness));
  uniforms->SetUniformf("metallic", static_cast<float>(shading.style.metallic));
  uniforms->SetUniformf("solidNumber", static_cast<float>(shading.number));
}

}  // namespace

double SolidActors::OpacityOf(ObjectLook look) const {
  constexpr double kInvisibleOpacity = 1e-3;  // invisible, but still drawn: outlines are made from it
  return look == ObjectLook::kSolid   ? style_.opacity
         : look == ObjectLook::kGlass ? std::max(style_.glass, kInvisibleOpacity)
                                      : kInvisibleOpacity;
}

SolidActors::Solid SolidActors::MakeSolid(int number) const {
  Solid solid;
  solid.back = MakeActor(SeeThrough(), clip_);
  solid.front = MakeActor(SeeThrough(), clip_);
  for (vtkActor* actor : {solid.back.Get(), solid.front.Get()}) {
    MapperOf(actor)->ScalarVisibilityOff();
  }
  SetSolidShader(solid.front, {.style = style_, .number = number, .see_through = SeeThrough()});
  SetSolidShader(solid.back,
                 {.style = style_, .number = number, .far_side = true, .see_through = SeeThrough()});
  solid.back->GetProperty()->FrontfaceCullingOn();
  solid.front->GetProperty()->BackfaceCullingOn();
  return solid;
}

std::vector<std::pair<Eigen::Vector3d, ObjectLook>> SolidActors::Looks() const {
  return ToVector(solids_, [](const Solid& solid) { return std::pair(solid.color, solid.look); });
}

void SolidActors::Show(const std::vector<SnapshotObject>& objects, const ObjectColor& color_of, bool dense) {
  const bool see_through = style_.look == ObjectLook::kAuto
                               ? dense
                               : style_.look == ObjectLook::kGlass || style_.look == ObjectLook::kOutline;
  if (std::exchange(see_through_, see_through) != see_through) {
    solids_.clear();
  }
  std::size_t count = 0;
  for (const SnapshotObject& object : objects) {
    for (const PosedSuperquadric& posed : DrawnSolids(object, style_)) {
      solids_.resize(std::max(solids_.size(), ++count));
      Solid& solid = solids_[count - 1];
      if (!solid.front) {
        solid = MakeSolid(static_cast<int>(count));
      }
      solid.color = color_of(object);
      solid.look = LookOf(object, style_, dense);
      Place(posed, solid);
    }
  }
  solids_.resize(count);
  translucent_ = std::ranges::any_of(solids_, [](const Solid& solid) { return solid.opacity < 1.0; });
  order_ = translucent_ ? SolidOrder(ToVector(solids_, &Solid::posed)) : SolidOrder();
}

// Moves the actors of a solid with its colour and look.
void SolidActors::Place(const PosedSuperquadric& posed, Solid& solid) const {
  const Superquadric& before = solid.posed.shape;
  if (posed.shape.half_size != before.half_size || posed.shape.e1 != before.e1 ||
      posed.shape.e2 != before.e2) {
    solid.segments = 0;
  }
  solid.posed = posed;
  solid.opacity = OpacityOf(solid.look);
  const Eigen::Matrix4d transposed = posed.T_map_object.Matrix().transpose();  // VTK is row-major
  for (vtkActor* actor : {solid.back.Get(), solid.front.Get()}) {
    actor->GetUserMatrix()->DeepCopy(transposed.data());
    actor->GetProperty()->SetColor(solid.color.x(), solid.color.y(), solid.color.z());
    actor->GetProperty()->SetOpacity(solid.opacity);
  }
}

int SolidActors::SegmentsFor(const PosedSuperquadric& solid, const ViewCamera& camera, double pixels) const {
  // With n segments, a chord deviates from the curve by at most 5 / n^2 half axes at the exponents in use. A
  // fifth of a sample is not visible.
  constexpr double kMaxChordError = 0.2;
  const double distance =
      std::max((solid.T_map_object.translation - camera.position).norm() - solid.shape.half_size.maxCoeff(),
               0.1 * solid.shape.half_size.maxCoeff());
  const double focal = camera.FocalLength(pixels);
  const double radius = focal * solid.shape.half_size.maxCoeff() / distance;
  const double wanted = std::sqrt(5.0 * radius / kMaxChordError);
  for (const int segments : {16, 24, 32, 48, 64, 96}) {
    if (wanted <= segments) {
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

std::vector<vtkActor*> SolidActors::Arrange(const ViewCamera& camera, double pixels,
                                            const Surroundings& around) {
  std::vector<vtkActor*> actors = InOrder(camera, pixels);
  // Directions of the studio in the view frame: x right, y up, z towards the viewer.
  const ViewAxes axes = AxesOf(camera);
  const std::pair<const char*, Eigen::Vector3d> directions[] = {{"roomUp", around.studio.up},
                                                                {"roomLamp", around.studio.Lamp()},
                                                                {"roomWindow", around.studio.Window()}};
  for (const auto& [name, d] : directions) {
    const Eigen::Vector3f seen =
        Eigen::Vector3d(d.dot(axes.right), d.dot(axes.up), d.dot(axes.back)).cast<float>();
    for (vtkActor* actor : actors) {
      actor->GetShaderProperty()->GetFragmentCustomUniforms()->SetUniform3f(name, seen.data());
    }
  }
  for (vtkActor* actor : actors) {
    actor->GetShaderProperty()->GetFragmentCustomUniforms()->SetUniformi("parallelRays", around.parallel);
  }
  if (SeeThrough()) {
    for (vtkActor* actor : actors) {
      actor->GetShaderProperty()->GetFragmentCustomUniforms()->SetUniform3f("surfaceRange",
                                                                            around.range.data());
      actor->GetShaderProperty()->GetVertexCustomUniforms()->SetUniformf("nearer", around.nearer);
    }
  }
  return actors;
}

std::vector<vtkActor*> SolidActors::InOrder(const ViewCamera& camera, double pixels) {
  std::vector<vtkActor*> actors;
  if (!style_.show) {
    return actors;
  }
  const auto add = [&](Solid& solid) {
    if (!SeeThrough() && solid.opacity <= 0.0) {
      return;
    }
    SetDetail(solid, SegmentsFor(solid.posed, camera, pixels));
    // Far sides are visible in solids that are cut; in glass they would only make it duller.
    if ((solid.look == ObjectLook::kSolid && solid.opacity < 1.0) || clip_->GetNumberOfItems() > 0) {
      actors.push_back(solid.back);
    }
    actors.push_back(solid.front);
  };
  if (!translucent_) {
    std::ranges::for_each(solids_, add);
    return actors;
  }
  for (const std::size_t index : order_.BackToFront(camera.position)) {
    add(solids_[index]);
  }
  return actors;
}

}  // namespace sqslam
