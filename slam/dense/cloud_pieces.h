#pragma once

#include <cstdint>
#include <mutex>
#include <unordered_set>

#include "slam/snapshot/depth_map.h"

namespace sqslam {

// Tells the surfaces of all depth maps together from what lies alone in space: points that were matched by
// chance. Points hang together where the cubes that they lie in touch. Cubes are some pixels wide at the
// point's own depth: what is farther away has its points farther apart.
class CloudPieces {
 public:
  // Takes the places of a depth map's points; any thread may call it.
  void Add(const DepthMap& map);

  // Once all are there: tells the pieces of about `min_pixels` or more from the others.
  void Join(double min_pixels);

  // Takes the depth of pixels whose points lie in smaller pieces.
  void DropSmall(DepthMap& map) const;

 private:
  std::mutex mutex_;
  std::unordered_set<std::uint64_t> cubes_;  // after Join: those of large pieces
};

}  // namespace sqslam
