#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace sqslam {

// A truncated signed distance function on a voxel grid, stored in blocks around the surface only (Curless and
// Levoy, SIGGRAPH 1996; blocks as in Niessner et al., SIGGRAPH Asia 2013). A value.
struct SurfaceVolume {
  static constexpr int kEdge = 8;  // voxels along a block

  struct Voxel {
    float distance = 1.0F;  // from the surface in truncations, -1 to 1, positive towards the cameras
    float weight = 0.0F;    // 0: no camera saw it
    std::array<std::uint16_t, 3> rgb{};  // mean colour, in 256ths of a grey level
  };
  using Block = std::array<Voxel, static_cast<std::size_t>(kEdge* kEdge* kEdge)>;  // [z][y][x]
  using Place = std::array<std::int32_t, 3>;  // of a block, in blocks from the map's origin

  double voxel = 0.0;         // edge, map units; voxel (i, j, k) has its centre at voxel * (i, j, k)
  std::vector<Place> places;  // ascending
  std::vector<Block> blocks;  // one for each place

  static std::size_t IndexOf(int x, int y, int z) {
    return static_cast<std::size_t>((z * kEdge + y) * kEdge + x);
  }
};

}  // namespace sqslam
