#pragma once

#include <vtkNew.h>
#include <vtkOpenGLBufferObject.h>
#include <vtkOpenGLFramebufferObject.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkOpenGLVertexArrayObject.h>
#include <vtkShaderProgram.h>
#include <vtkSmartPointer.h>
#include <vtkTextureObject.h>

#include <Eigen/Core>
#include <array>
#include <opencv2/core/types.hpp>
#include <string>
#include <vector>

class vtkRenderer;

// Textures to draw into, programs that fill them, and the camera as these programs see it. For the sources of
// render/gl only.
namespace sqslam {

// A texture to draw into.
struct Target {
  // `format`: GL_DEPTH_COMPONENT (32 bit floats), GL_RG16F or GL_RGBA8.
  void Ensure(vtkOpenGLRenderWindow* window, int wanted_width, int wanted_height, int format,
              bool smooth = false);

  // Fills it with values of OpenGL's type, row by row from the lower left.
  void Fill(unsigned value_format, unsigned type, const void* values) const;

  int width = 0;
  int height = 0;
  vtkSmartPointer<vtkTextureObject> texture;
};

// A fragment program for a target; rebuilt if its text changes.
class ScreenProgram {
 public:
  vtkShaderProgram* Ready(vtkOpenGLRenderWindow* window, const std::string& declarations,
                          const std::string& code);

  // Fills these rectangles of a target, pixels from the lower left. Only after Ready.
  void Fill(const std::vector<cv::Rect>& areas, cv::Size target);

  void ReleaseGraphicsResources();

 private:
  vtkShaderProgram* program_ = nullptr;
  std::string text_;
  std::string source_;
  vtkNew<vtkOpenGLVertexArrayObject> array_;
  vtkNew<vtkOpenGLBufferObject> buffer_;
};

// Returns true if OpenGL draws on the CPU.
bool IsSoftwareRenderer();

// Binds the buffer; creates it first if needed.
void EnsureBound(vtkSmartPointer<vtkOpenGLFramebufferObject>& buffer, vtkOpenGLRenderWindow* window);

// Directs drawing to the whole buffer.
void StartDrawingTo(vtkOpenGLFramebufferObject* buffer, unsigned draw_buffers, vtkOpenGLState* state,
                    int width, int height);

std::array<float, 4> ToFloats(const Eigen::Vector4d& v);

// The camera of a renderer.
struct Lens {
  explicit Lens(vtkRenderer* renderer, const Eigen::Vector4d& ground_map = Eigen::Vector4d::Zero());

  // Samples that a map unit at distance 1 spans in a target of this height (samples).
  float FocalLength(int height) const { return 0.5F * static_cast<float>(height) * terms[1]; }

  bool parallel = false;         // orthographic; a map unit then spans the same at all distances
  std::array<float, 4> terms{};  // P00, P11, P02, P12 of the projection
  std::array<float, 2> depth_range{};
  std::array<float, 4> ground{};  // the ground plane seen from the camera
  Eigen::Matrix4d T_device_map;   // to clip coordinates
};

}  // namespace sqslam
