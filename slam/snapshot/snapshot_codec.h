#pragma once

#include <string>
#include <string_view>

#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Returns a position as recordings store it: coordinates of 16 significant bits (an error of at most 1.6e-5,
// far below the accuracy of map points), so that the lowest byte of each is zero.
Eigen::Vector3f RecordedPosition(const Eigen::Vector3d& p_map);

// Serializes a snapshot, uncompressed: little-endian, points by columns and by bytes of equal weight, so that
// values that did not change since the last snapshot stand in long equal runs; positions are rounded as by
// RecordedPosition.
std::string EncodeSnapshot(const MapSnapshot& snapshot);

// Throws InputError if the bytes are not a snapshot.
MapSnapshot DecodeSnapshot(std::string_view raw);

}  // namespace sqslam
