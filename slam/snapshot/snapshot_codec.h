#pragma once

#include <string>
#include <string_view>

#include "slam/snapshot/snapshot.h"

namespace sqslam {

inline constexpr int kSnapshotFormatVersion = 8;
// The oldest readable version: 2 has no anomaly and no rejected_by, 3 no progress, 4 no covisibility, 5 no
// reliability. In 6, no recording keeps a live map; in 7, each snapshot is compressed alone.
inline constexpr int kOldestSnapshotFormatVersion = 2;

// Returns a position as recordings store it: coordinates of 16 significant bits (an error of at most 1.6e-5,
// far below the accuracy of map points), so that the lowest byte of each is zero.
Eigen::Vector3f RecordedPosition(const Eigen::Vector3d& p_map);

// Serializes a snapshot, uncompressed: little-endian, points by columns and, since version 8, by bytes of
// equal weight, so that what did not change since the last snapshot stands in long equal runs; their
// positions are rounded as by RecordedPosition. Fields that the version lacks are left out.
std::string EncodeSnapshot(const MapSnapshot& snapshot, int version = kSnapshotFormatVersion);

// Throws InputError if the bytes are no snapshot of the version. Fields that the version lacks keep their
// defaults.
MapSnapshot DecodeSnapshot(std::string_view raw, int version = kSnapshotFormatVersion);

}  // namespace sqslam
