#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>

#include "slam/objects/landmark.h"
#include "slam/objects/object_types.h"

namespace sqslam {

// Returns the landmark (id) that each map point (id) belongs to: of those that hold it, the one whose surface
// is nearest.
std::unordered_map<std::int64_t, int> OwnersOfPoints(std::span<const Landmark* const> landmarks);

// Returns what the landmarks say about each map point (id) that was ever in one of their boxes.
std::unordered_map<std::int64_t, PointEvidence> EvidenceOfPoints(std::span<const Landmark* const> landmarks);

}  // namespace sqslam
