#pragma once

#include <filesystem>

#include "slam/snapshot/snapshot.h"

namespace sqslam::app {

// Writes an object as a robot of one link (URDF, metres, z up, origin at its centre), and its convex mesh as
// .obj beside it, for simulators and planners of motion. The mass is that of the class, the inertia that of a
// solid of even density. Throws InputError if the map has no scale or not exactly one object, or if a file
// cannot be written.
void WriteUrdf(const std::filesystem::path& path, const MapSnapshot& map);

}  // namespace sqslam::app
