#pragma once

#include <string>
#include <vector>

#include "slam/io/trajectory.h"

namespace sqslam {

// A step of the camera that no hand makes: the map may be wrong there.
struct PathJump {
  double before = 0.0;  // timestamps of the poses on either side, seconds
  double after = 0.0;
  double times = 0.0;  // its speed, in those of the steps around it
};

// Returns steps that stand alone: many times as fast as the usual one around them, and several times as fast
// as any other near them. A camera that begins to move fast goes on to do so; a wrong pose is there at once.
std::vector<PathJump> FindJumps(const Trajectory& trajectory);

std::string InWords(const std::vector<PathJump>& jumps);

}  // namespace sqslam
