#pragma once

#include "slam/geometry/camera.h"
#include "slam/map/map.h"
#include "slam/snapshot/byte_archive.h"

namespace sqslam {

// Writes keyframes with their keypoints, descriptors and observations, and map points. Keypoints are rounded
// to 1/64 px, their orientations to 1/65536 of a turn. What follows from the observations is left out:
// appearance and colour of points, words, grids.
void WriteMap(const Map& map, ByteWriter& writer);

// Reads what WriteMap wrote into an empty map; written again it gives the same bytes. Throws InputError where
// the bytes make no sound map: ids that lead nowhere, places beyond kMaxMapUnits.
void ReadMap(ByteReader& reader, const Camera& camera, Map& map);

}  // namespace sqslam
