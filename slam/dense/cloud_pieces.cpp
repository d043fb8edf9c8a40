#include "slam/dense/cloud_pieces.h"

#include <cmath>

#include "slam/dense/voxel_table.h"
#include "slam/util/disjoint_sets.h"

namespace sqslam {

// Returns the cube of a pixel's point, 2 to 4 pixels wide at its depth.
CloudPieces::Cube CloudPieces::CubeOf(const DepthMap& map, int x, int y) {
  const int level = std::ilogb(map.depth.at<float>(y, x) / map.camera.fx) + 2;
  const auto [i, j, k] = CubeAt(map.PointAt(x, y).array() * std::ldexp(1.0, -level));
  return {level, i, j, k};
}

void CloudPieces::Add(const DepthMap& map) {
  std::vector<Cube> found;
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      if (map.depth.at<float>(y, x) > 0.0F) {
        found.push_back(CubeOf(map, x, y));
      }
    }
  }
  const std::lock_guard lock(mutex_);
  for (const Cube& cube : found) {
    if (index_.Insert(cube).second) {
      cubes_.push_back(cube);
    }
  }
}

void CloudPieces::Join(double min_pixels) {
  constexpr double kPixelsPerCube = 9.0;  // of a surface, on average
  constexpr int kLevelsAbove =
      3;  // levels between connected cubes: one surface seen from different distances
  DisjointSets sets(cubes_.size());
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(cubes_.size()); ++i) {
    const auto join = [&](const Cube& other) {
      if (const std::uint32_t found = IndexOf(other); found != KeyIndex<4>::kNotFound) {
        sets.Join(i, static_cast<std::int32_t>(found));
      }
    };
    auto [level, x, y, z] = cubes_[static_cast<std::size_t>(i)];
    for (int step = 14; step < 27; ++step) {  // half of the neighbours: the other half join this cube
      join({level, x + step / 9 - 1, y + step / 3 % 3 - 1, z + step % 3 - 1});
    }
    for (int coarser = 1; coarser <= kLevelsAbove; ++coarser) {
      join({level + coarser, x >> coarser, y >> coarser, z >> coarser});
    }
  }
  std::vector<int> sizes(cubes_.size());
  for (std::size_t i = 0; i < cubes_.size(); ++i) {
    ++sizes[static_cast<std::size_t>(sets.Root(static_cast<std::int32_t>(i)))];
  }
  for (std::size_t i = 0; i < cubes_.size(); ++i) {
    const auto root = static_cast<std::size_t>(sets.Root(static_cast<std::int32_t>(i)));
    small_.push_back(kPixelsPerCube * sizes[root] < min_pixels);
  }
}

void CloudPieces::DropSmall(DepthMap& map) const {
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      if (!(map.depth.at<float>(y, x) > 0.0F)) {
        continue;
      }
      const std::uint32_t cube = IndexOf(CubeOf(map, x, y));
      if (cube == KeyIndex<4>::kNotFound || small_[cube]) {  // none: a recording rounds depths
        map.depth.at<float>(y, x) = 0.0F;
        map.views.at<std::uint8_t>(y, x) = 0;
      }
    }
  }
}

}  // namespace sqslam
