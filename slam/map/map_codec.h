#pragma once

#include "slam/geometry/camera.h"
#include "slam/map/map.h"
#include "slam/snapshot/byte_archive.h"

namespace sqslam {

// Serializes keyframes with keypoints, descriptors and observations, and map points. Keypoints are rounded to
// 1/64 px, orientations to 1/65536 of a turn. Anything that follows from the observations is left out:
// appearance and colour of points, bags of words, grids.
void WriteMap(const Map& map, ByteWriter& writer);

// Reads what WriteMap wrote into an empty map, which WriteMap then writes as the same bytes. Throws
// InputError if the bytes make no valid map: ids that lead nowhere, positions beyond kMaxMapUnits.
void ReadMap(ByteReader& reader, const Camera& camera, Map& map);

}  // namespace sqslam
