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

// Bounding boxes of moving objects, which get no depth.
class MovingMask {
 public:
  MovingMask() = default;

  // Reads boxes.txt of the result folder, or else that of the sequence; without either, nothing is masked.
  // `sequence`: opened with the camera of the map.
  MovingMask(const std::filesystem::path& result, const Sequence& sequence,
             const std::vector<std::string>& labels);

  // Removes the depth of pixels in the boxes of the map's frame.
  void Apply(DepthMap& map) const;

 private:
  std::map<std::int64_t, std::vector<Box2d>> boxes_;  // by frame, relative to the image's width and height
};

}  // namespace sqslam
