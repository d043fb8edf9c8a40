#pragma once

#include <cstdint>
#include <mutex>
#include <unordered_set>

#include "slam/snapshot/depth_map.h"

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
  std::mutex mutex_;
  std::unordered_set<std::uint64_t> cubes_;  // after Join: only those of large pieces
};

}  // namespace sqslam
