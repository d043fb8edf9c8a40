#pragma once

#include <string>
#include <string_view>

#include "slam/snapshot/snapshot.h"

namespace sqslam {

inline constexpr int kSnapshotFormatVersion = 7;
// The oldest readable version: 2 has no anomaly and no rejected_by, 3 no progress, 4 no covisibility, 5 no
// reliability. In 6, no recording keeps a live map.
inline constexpr int kOldestSnapshotFormatVersion = 2;

// Serializes a snapshot: little-endian, points as float32 by columns (which compress better), then zlib.
std::string EncodeSnapshot(const MapSnapshot& snapshot);

// Throws InputError if the bytes are no snapshot of the version. Fields that the version lacks keep their
// defaults.
MapSnapshot DecodeSnapshot(std::string_view bytes, int version = kSnapshotFormatVersion);

}  // namespace sqslam
