#pragma once

#include <vtkNew.h>
#include <vtkOpenGLBufferObject.h>
#include <vtkOpenGLVertexArrayObject.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

class vtkRenderer;
class vtkShaderProgram;

namespace sqslam {

class SplatRaster;

// Draws coloured points as discs from one buffer. VTK's mappers are several times slower, have one size for
// all points of an actor, and copy the points whenever some are left out. For the sources of render/ only.
class PointSplats {
 public:
  struct Vertex {
    Eigen::Vector3f p_map = Eigen::Vector3f::Zero();
    float size = 0.0F;   // diameter: samples of the picture, or map units
    float frame = 0.0F;  // first frame in which it is drawn
    std::array<std::uint8_t, 4> rgba{};
  };
  // Vertices to draw, with a minimum size.
  struct Range {
    int first = 0;
    int count = 0;
    float least_size = 0.0F;
  };
  struct Look {
    bool in_map_units = false;                         // sizes shrink with distance
    float scale = 1.0F;                                // factor on the sizes
    float least = 1.0F;                                // minimum diameter, samples
    float newest = std::numeric_limits<float>::max();  // frame; later points are not drawn
    // Clip plane (normal, height), map frame: points with normal . p > height are not drawn.
    Eigen::Vector4f cut = Eigen::Vector4f(0.0F, 0.0F, 0.0F, 1.0F);
  };

  void SetVertices(std::vector<Vertex> vertices);
  void SetRanges(std::vector<Range> ranges) { ranges_ = std::move(ranges); }
  void SetLook(const Look& look) { look_ = look; }

  // Draws into the bound targets, with their depth test. `height`: of the target, samples.
  void Draw(vtkRenderer* renderer, int height);
  // Draws into a picture that the processor makes. Only if Draw is never called.
  void Draw(vtkRenderer* renderer, SplatRaster& raster) const;
  void ReleaseGraphicsResources();

 private:
  void Upload(vtkShaderProgram* program);

  std::vector<Vertex> pending_;  // not uploaded yet
  int count_ = 0;
  bool uploaded_ = false;
  std::vector<Range> ranges_;
  Look look_;
  vtkNew<vtkOpenGLBufferObject> buffer_;
  vtkNew<vtkOpenGLVertexArrayObject> array_;
  vtkShaderProgram* program_ = nullptr;  // program of `array_`; owned by VTK's cache
};

}  // namespace sqslam
