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

// Coloured points as discs, drawn straight from one buffer: VTK's mappers take several times as long,
// know one size for all points of an actor, and copy the points whenever some of them are to be left out. For
// the sources of render/ only.
class PointSplats {
 public:
  struct Vertex {
    Eigen::Vector3f p_map = Eigen::Vector3f::Zero();
    float size = 0.0F;   // diameter: samples of the picture, or map units
    float frame = 0.0F;  // drawn from this frame on
    std::array<std::uint8_t, 4> rgba{};
  };
  // Vertices to draw, with no smaller size than this.
  struct Range {
    int first = 0;
    int count = 0;
    float least_size = 0.0F;
  };
  struct Look {
    bool in_map_units = false;                         // sizes shrink with the distance
    float scale = 1.0F;                                // of the sizes
    float least = 1.0F;                                // diameter, samples
    float newest = std::numeric_limits<float>::max();  // frame: later points are not drawn
    // Points in front of this plane are not drawn, normal . p > height: normal and height, map frame.
    Eigen::Vector4f cut = Eigen::Vector4f(0.0F, 0.0F, 0.0F, 1.0F);
  };

  void SetVertices(std::vector<Vertex> vertices);
  void SetRanges(std::vector<Range> ranges) { ranges_ = std::move(ranges); }
  void SetLook(const Look& look) { look_ = look; }

  // Into the targets that are bound, with their depth test. `height`: of the target, samples.
  void Draw(vtkRenderer* renderer, int height);
  void ReleaseGraphicsResources();

 private:
  void Upload(vtkShaderProgram* program);

  std::vector<Vertex> waiting_;  // to be uploaded
  int count_ = 0;
  bool uploaded_ = false;
  std::vector<Range> ranges_;
  Look look_;
  vtkNew<vtkOpenGLBufferObject> buffer_;
  vtkNew<vtkOpenGLVertexArrayObject> array_;
  vtkShaderProgram* program_ = nullptr;  // that `array_` was made for; belongs to VTK's cache
};

}  // namespace sqslam
