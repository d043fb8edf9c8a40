#pragma once

#include <vtkOpenGLFramebufferObject.h>
#include <vtkOpenGLQuadHelper.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkShaderProgram.h>
#include <vtkSmartPointer.h>
#include <vtkTextureObject.h>

#include <memory>
#include <string>

// Textures to draw into and programs that fill them. For the sources of render/gl only.
namespace sqslam {

// A texture to draw into.
struct Target {
  // `format`: GL_DEPTH_COMPONENT (32 bit floats), GL_RG16F or GL_RGBA8.
  void Ensure(vtkOpenGLRenderWindow* window, int wanted_width, int wanted_height, int format,
              bool smooth = false);

  int width = 0;
  int height = 0;
  vtkSmartPointer<vtkTextureObject> texture;
};

// A fragment program for the whole target; rebuilt if its text changes.
struct ScreenProgram {
  vtkShaderProgram* Ready(vtkOpenGLRenderWindow* window, const std::string& declarations,
                          const std::string& code);

  std::unique_ptr<vtkOpenGLQuadHelper> quad;
  std::string text;
};

// Binds the buffer; creates it first if needed.
void BindReady(vtkSmartPointer<vtkOpenGLFramebufferObject>& buffer, vtkOpenGLRenderWindow* window);

// Directs drawing to the whole buffer.
void Use(vtkOpenGLFramebufferObject* buffer, unsigned draw_buffers, vtkOpenGLState* state, int width,
         int height);

}  // namespace sqslam
