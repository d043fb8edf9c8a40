#include "render/gl/screen_program.h"

#include <vtkCamera.h>
#include <vtkMatrix3x3.h>
#include <vtkMatrix4x4.h>
#include <vtkOpenGLCamera.h>
#include <vtkOpenGLRenderUtilities.h>
#include <vtkOpenGLShaderCache.h>
#include <vtkRenderer.h>
#include <vtk_glew.h>

#include <Eigen/LU>
#include <array>
#include <cstddef>

namespace sqslam {

void Target::Ensure(vtkOpenGLRenderWindow* window, int wanted_width, int wanted_height, int format,
                    bool smooth) {
  if (texture && width == wanted_width && height == wanted_height) {
    return;
  }
  width = wanted_width;
  height = wanted_height;
  texture = vtkSmartPointer<vtkTextureObject>::New();
  texture->SetContext(window);
  const auto filter = smooth ? vtkTextureObject::Linear : vtkTextureObject::Nearest;
  texture->SetMinificationFilter(filter);
  texture->SetMagnificationFilter(filter);
  texture->SetWrapS(vtkTextureObject::ClampToEdge);
  texture->SetWrapT(vtkTextureObject::ClampToEdge);
  if (format == GL_DEPTH_COMPONENT) {
    texture->AllocateDepth(static_cast<unsigned>(width), static_cast<unsigned>(height),
                           vtkTextureObject::Float32);
    return;
  }
  const bool bytes = format == GL_RGBA8;
  texture->SetInternalFormat(static_cast<unsigned>(format));
  texture->SetFormat(bytes ? GL_RGBA : GL_RG);
  texture->SetDataType(bytes ? GL_UNSIGNED_BYTE : GL_FLOAT);
  texture->Allocate2D(static_cast<unsigned>(width), static_cast<unsigned>(height), bytes ? 4 : 2,
                      bytes ? VTK_UNSIGNED_CHAR : VTK_FLOAT);
}

void Target::Fill(unsigned value_format, unsigned type, const void* values) const {
  texture->Activate();
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, value_format, type, values);
  texture->Deactivate();
}

vtkShaderProgram* ScreenProgram::Ready(vtkOpenGLRenderWindow* window, const std::string& declarations,
                                       const std::string& code) {
  if (text_ != declarations + code) {
    text_ = declarations + code;
    source_ = vtkOpenGLRenderUtilities::GetFullScreenQuadFragmentShaderTemplate();
    vtkShaderProgram::Substitute(source_, "//VTK::FSQ::Decl", declarations);
    vtkShaderProgram::Substitute(source_, "//VTK::FSQ::Impl", code);
  }
  vtkShaderProgram* program = window->GetShaderCache()->ReadyShaderProgram(
      vtkOpenGLRenderUtilities::GetFullScreenQuadVertexShader().c_str(), source_.c_str(), "");
  if (program != program_) {
    array_->ShaderProgramChanged();  // it takes the attributes of one program only
    program_ = program;
  }
  return program_;
}

void ScreenProgram::Fill(const std::vector<cv::Rect>& areas, cv::Size target) {
  if (areas.empty()) {
    return;
  }
  struct Corner {
    std::array<float, 2> device;
    std::array<float, 2> share;  // of the target's sides
  };
  std::vector<Corner> corners;  // of two triangles for each rectangle
  for (const cv::Rect& area : areas) {
    const cv::Point right(area.width, 0);
    for (const cv::Point& p :
         {area.tl(), area.tl() + right, area.br(), area.tl(), area.br(), area.br() - right}) {
      const float x = static_cast<float>(p.x) / static_cast<float>(target.width);
      const float y = static_cast<float>(p.y) / static_cast<float>(target.height);
      corners.push_back({{2.0F * x - 1.0F, 2.0F * y - 1.0F}, {x, y}});
    }
  }
  buffer_->Upload(corners, vtkOpenGLBufferObject::ArrayBuffer);
  array_->Bind();
  array_->AddAttributeArray(program_, buffer_, "ndCoordIn", offsetof(Corner, device), sizeof(Corner),
                            VTK_FLOAT, 2, false);
  array_->AddAttributeArray(program_, buffer_, "texCoordIn", offsetof(Corner, share), sizeof(Corner),
                            VTK_FLOAT, 2, false);
  glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(corners.size()));
  array_->Release();
}

void ScreenProgram::ReleaseGraphicsResources() {
  array_->ReleaseGraphicsResources();
  buffer_->ReleaseGraphicsResources();
}

bool IsSoftwareRenderer() {
  const std::string name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));  // NOLINT: bytes
  return name.starts_with("llvmpipe") || name.starts_with("softpipe");
}

void EnsureBound(vtkSmartPointer<vtkOpenGLFramebufferObject>& buffer, vtkOpenGLRenderWindow* window) {
  if (!buffer) {
    buffer = vtkSmartPointer<vtkOpenGLFramebufferObject>::New();
    buffer->SetContext(window);
  }
  buffer->Bind();
}

void StartDrawingTo(vtkOpenGLFramebufferObject* buffer, unsigned draw_buffers, vtkOpenGLState* state,
                    int width, int height) {
  buffer->ActivateDrawBuffers(draw_buffers);
  buffer->StartNonOrtho(width, height);
  state->vtkglViewport(0, 0, width, height);
  state->vtkglScissor(0, 0, width, height);
}

std::array<float, 4> ToFloats(const Eigen::Vector4d& v) {
  const Eigen::Vector4f f = v.cast<float>();
  return {f[0], f[1], f[2], f[3]};
}

Lens::Lens(vtkRenderer* renderer, const Eigen::Vector4d& ground_map) {
  auto* camera = vtkOpenGLCamera::SafeDownCast(renderer->GetActiveCamera());
  vtkMatrix4x4* to_view = nullptr;
  vtkMatrix3x3* normals = nullptr;
  vtkMatrix4x4* projection = nullptr;
  vtkMatrix4x4* whole = nullptr;
  camera->GetKeyMatrices(renderer, to_view, normals, projection, whole);
  // VTK stores the matrices transposed, as OpenGL reads them.
  const auto element = [&](int row, int column) {
    return static_cast<float>(projection->GetElement(column, row));
  };
  parallel = camera->GetParallelProjection() != 0;
  terms = {element(0, 0), element(1, 1), element(0, 2), element(1, 2)};
  depth_range = {static_cast<float>(camera->GetClippingRange()[0]),
                 static_cast<float>(camera->GetClippingRange()[1])};
  const Eigen::Matrix4d T_view_map = Eigen::Map<const Eigen::Matrix4d>(to_view->GetData());
  T_device_map = Eigen::Map<const Eigen::Matrix4d>(whole->GetData());
  ground = ToFloats(T_view_map.inverse().transpose() * ground_map);
}

}  // namespace sqslam
