#include "render/gl/screen_program.h"

#include <vtkOpenGLRenderUtilities.h>
#include <vtkOpenGLShaderCache.h>
#include <vtk_glew.h>

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

vtkShaderProgram* ScreenProgram::Ready(vtkOpenGLRenderWindow* window, const std::string& declarations,
                                       const std::string& code) {
  if (!quad || text != declarations + code) {
    text = declarations + code;
    std::string source = vtkOpenGLRenderUtilities::GetFullScreenQuadFragmentShaderTemplate();
    vtkShaderProgram::Substitute(source, "//VTK::FSQ::Decl", declarations);
    vtkShaderProgram::Substitute(source, "//VTK::FSQ::Impl", code);
    quad = std::make_unique<vtkOpenGLQuadHelper>(
        window, vtkOpenGLRenderUtilities::GetFullScreenQuadVertexShader().c_str(), source.c_str(), "");
  } else {
    window->GetShaderCache()->ReadyShaderProgram(quad->Program);
  }
  return quad->Program;
}

void BindReady(vtkSmartPointer<vtkOpenGLFramebufferObject>& buffer, vtkOpenGLRenderWindow* window) {
  if (!buffer) {
    buffer = vtkSmartPointer<vtkOpenGLFramebufferObject>::New();
    buffer->SetContext(window);
  }
  buffer->Bind();
}

void Use(vtkOpenGLFramebufferObject* buffer, unsigned draw_buffers, vtkOpenGLState* state, int width,
         int height) {
  buffer->ActivateDrawBuffers(draw_buffers);
  buffer->StartNonOrtho(width, height);
  state->vtkglViewport(0, 0, width, height);
  state->vtkglScissor(0, 0, width, height);
}

}  // namespace sqslam
