#pragma once

#include <string>

#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Unit and frame of the numbers in a file.
struct MapFrame {
  bool metric = false;   // metres, else map units
  bool upright = false;  // z points up against gravity

  const char* Unit() const { return metric ? "metres" : "map units"; }
  // Returns "map frame, z up" and the like.
  std::string Frame() const { return upright ? "map frame, z up" : "map frame, not aligned with gravity"; }
  std::string Text() const { return std::string(Unit()) + "; " + Frame(); }
};

inline MapFrame FrameOf(const MapSnapshot& map) { return {map.metric, map.gravity_known}; }

}  // namespace sqslam
