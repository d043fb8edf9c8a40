#pragma once

#include <mutex>
#include <vector>

#include "slam/snapshot/depth_map.h"
#include "slam/util/key_index.h"

namespace sqslam {

// Separates the surfaces of all depth maps from isolated points, which were matched by chance. Points are
// connected if their cubes touch. Cubes are some pixels wide at the point's own depth, because distant points
// lie farther apart.
class CloudPieces {
 public:
  // Adds the points of a depth map. Thread-safe.
  void Add(const DepthMap& map);

  // Call after the last Add: separates pieces of about `min_pixels` or more from smaller ones.
  void Join(double min_pixels);

  // Removes the depth of pixels whose points lie in smaller pieces.
  void DropSmall(DepthMap& map) const;

 private:
  // Logarithm of the edge to base 2, then x, y, z in edges: each cube lies within one of the next level.
  using Cube = KeyIndex<4>::Key;

  static Cube CubeOf(const DepthMap& map, int x, int y);
  std::uint32_t IndexOf(const Cube& cube) const { return index_.Find(KeyIndex<4>::HashOf(cube), cube); }

  std::mutex mutex_;
  KeyIndex<4> index_;  // of the cubes
  std::vector<Cube> cubes_;
  std::vector<bool> small_;  // by cube: it belongs to a small piece
};

}  // namespace sqslam
