#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "slam/dense/dense_options.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/surface_volume.h"

namespace sqslam {

// A coloured mesh with holes where nothing was seen.
struct SurfaceMesh {
  std::vector<Eigen::Vector3f> vertices;  // map frame
  std::vector<std::array<std::uint8_t, 3>> rgb;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // counter-clockwise seen from the cameras' side
  std::vector<std::int32_t> frames;  // of each vertex, from which it is seen in a growing map; empty: always
};
using SurfaceMeshPtr = std::shared_ptr<const SurfaceMesh>;

// Triangles where the volume's distance is 0 between voxels that were both seen (flying edges: Schroeder,
// Maynard and Geveci, LDAV 2015). Small pieces are left out; a mesh with more than the wanted triangles is
// thinned out by quadric errors of place and colour (Garland and Heckbert, VIS 1998).
SurfaceMesh MarchSurface(const SurfaceVolume& volume, const SurfaceOptions& options);

// Sets the frames from which a recording's mesh is seen: at each vertex that of the first depth map that has
// the surface there. Throws InputError as reading the depth maps does.
void MarkFirstSeen(const DepthRecording& depths, SurfaceMesh& mesh);

}  // namespace sqslam
