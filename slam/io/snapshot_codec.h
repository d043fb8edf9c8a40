#pragma once

#include <string>
#include <string_view>

#include "slam/map/snapshot.h"

namespace sqslam {

inline constexpr int kSnapshotFormatVersion = 2;

// A snapshot as bytes: little-endian, points as float32 and by columns (which packs better), then zlib.
std::string EncodeSnapshot(const MapSnapshot& snapshot);

// Throws InputError where the bytes are no snapshot of this version.
MapSnapshot DecodeSnapshot(std::string_view bytes);

}  // namespace sqslam
