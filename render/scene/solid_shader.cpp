#include "render/scene/solid_shader.h"

#include <vtkActor.h>
#include <vtkDataObject.h>
#include <vtkPolyDataMapper.h>
#include <vtkShaderProperty.h>
#include <vtkUniforms.h>

#include "render/gl/picture_shaders.h"
#include "render/scene/studio_light.h"

namespace sqslam {

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

}  // namespace sqslam
