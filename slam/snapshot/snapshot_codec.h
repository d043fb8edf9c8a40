#pragma once

#include <string>
#include <string_view>

#include "slam/snapshot/snapshot.h"

namespace sqslam {

inline constexpr int kSnapshotFormatVersion = 7;
// The oldest that can be read: 2 has no anomaly, no rejected_by; 3 no progress; 4 no covisibility; 5 no
// reliability. 6 differs from 7 in that no recording keeps a live map.
inline constexpr int kOldestSnapshotFormatVersion = 2;

// A snapshot as bytes: little-endian, points as float32 and by columns (which packs better), then zlib.
std::string EncodeSnapshot(const MapSnapshot& snapshot);

// Throws InputError where the bytes are no snapshot of the version. Fields that it did not have yet are left
// at their defaults.
MapSnapshot DecodeSnapshot(std::string_view bytes, int version = kSnapshotFormatVersion);

}  // namespace sqslam
