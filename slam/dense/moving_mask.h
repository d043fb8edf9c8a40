#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/io/sequence.h"
#include "slam/snapshot/depth_map.h"

namespace sqslam {

// Boxes of things that move by themselves, which take part in no surface.
class MovingMask {
 public:
  MovingMask() = default;

  // Reads boxes.txt of the result folder or, where there is none, of the sequence's; without either nothing
  // is masked. `sequence`: opened with the camera of the map.
  MovingMask(const std::filesystem::path& result, const Sequence& sequence,
             const std::vector<std::string>& labels);

  // Takes the depth from the pixels in the boxes of the map's frame.
  void Apply(DepthMap& map) const;

 private:
  std::map<std::int64_t, std::vector<Box2d>> boxes_;  // by frame, in shares of the image's width and height
};

}  // namespace sqslam
