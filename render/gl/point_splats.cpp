#include "render/gl/point_splats.h"

#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLShaderCache.h>
#include <vtkRenderer.h>
#include <vtkShaderProgram.h>
#include <vtk_glew.h>

#include <cstddef>

#include "picture_shaders.h"
#include "render/gl/screen_program.h"
#include "render/gl/splat_raster.h"

namespace sqslam {
void PointSplats::SetVertices(std::vector<Vertex> vertices) {
  count_ = static_cast<int>(vertices.size());
  pending_ = std::move(vertices);
  ranges_ = {{0, count_, 0.0F}};
  uploaded_ = false;
}

void PointSplats::Upload(vtkShaderProgram* program) {
  if (!uploaded_) {
    buffer_->Upload(pending_, vtkOpenGLBufferObject::ArrayBuffer);
    std::vector<Vertex>().swap(pending_);
    uploaded_ = true;
    program_ = nullptr;
  }
  array_->Bind();
  if (program_ == program) {
    return;
  }
  program_ = program;
  array_->ShaderProgramChanged();
  array_->Bind();
  const auto add = [&](const char* name, std::size_t offset, int type, int components, bool normalize) {
    array_->AddAttributeArray(program, buffer_, name, static_cast<int>(offset), sizeof(Vertex), type,
                              components, normalize);
  };
  add("placeMC", offsetof(Vertex, p_map), VTK_FLOAT, 3, false);
  add("size", offsetof(Vertex, size), VTK_FLOAT, 1, false);
  add("frame", offsetof(Vertex, frame), VTK_FLOAT, 1, false);
  add("rgba", offsetof(Vertex, rgba), VTK_UNSIGNED_CHAR, 4, true);
}

void PointSplats::Draw(vtkRenderer* renderer, int height) {
  if (count_ == 0 || ranges_.empty()) {
    return;
  }
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow());
  vtkShaderProgram* program =
      window->GetShaderCache()->ReadyShaderProgram(shaders::kSplatVertex, shaders::kSplatFragment, "");
  Upload(program);
  const Lens lens(renderer);
  const Eigen::Matrix4f T_device_map = lens.T_device_map.cast<float>();
  program->SetUniformMatrix4x4("toDevice",
                               const_cast<float*>(T_device_map.data()));  // NOLINT: VTK only reads
  program->SetUniformf("focal", look_.scale * lens.FocalLength(height));
  program->SetUniformf("scale", look_.scale);
  program->SetUniformi("inMapUnits", look_.in_map_units ? 1 : 0);
  program->SetUniformf("least", look_.least);
  program->SetUniformf("newest", look_.newest);
  program->SetUniform4f("cut", look_.cut.data());
  glEnable(GL_PROGRAM_POINT_SIZE);
  for (const Range& range : ranges_) {
    program->SetUniformf("leastSize", range.least_size);
    glDrawArrays(GL_POINTS, range.first, range.count);
  }
  glDisable(GL_PROGRAM_POINT_SIZE);
  array_->Release();
}

void PointSplats::Draw(vtkRenderer* renderer, SplatRaster& raster) const {
  const Lens lens(renderer);
  raster.Draw(pending_, ranges_, look_, lens.T_device_map.cast<float>(),
              lens.FocalLength(raster.Colors().rows));
}

void PointSplats::ReleaseGraphicsResources() {
  array_->ReleaseGraphicsResources();
  buffer_->ReleaseGraphicsResources();
  program_ = nullptr;
  count_ = 0;
}

}  // namespace sqslam
