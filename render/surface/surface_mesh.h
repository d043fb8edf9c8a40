#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "slam/dense/dense_options.h"
#include "slam/snapshot/depth_map.h"
#include "slam/snapshot/depth_recording.h"

namespace sqslam {

// A coloured mesh, with holes where no camera saw a surface.
struct SurfaceMesh {
  std::vector<Eigen::Vector3f> vertices;  // map frame
  std::vector<std::array<std::uint8_t, 3>> rgb;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // counter-clockwise seen from the cameras' side
  std::vector<std::int32_t> frames;  // first frame that shows each vertex in a growing map; empty: always
};
using SurfaceMeshPtr = std::shared_ptr<const SurfaceMesh>;

// Extracts the zero level set between observed voxels with flying edges (Schroeder, Maynard and Geveci, LDAV
// 2015), removes small components, and simplifies a mesh with too many triangles by quadric errors of
// position and colour (Garland and Heckbert, VIS 1998).
SurfaceMesh MarchSurface(const SurfaceVolume& volume, const SurfaceOptions& options);

// Sets `frames` of a recording's mesh: for each vertex, the frame of the first depth map that shows the
// surface there. Throws InputError if a depth map cannot be read.
void MarkFirstSeen(const DepthRecording& depths, SurfaceMesh& mesh);

}  // namespace sqslam
