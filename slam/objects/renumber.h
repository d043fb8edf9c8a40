#pragma once

#include <cstdint>

#include "slam/objects/landmark.h"

namespace sqslam {

// Shifts the id of a landmark, those of its map points, and the indices of its frames.
void Renumber(int id_shift, std::int64_t point_shift, std::int64_t frame_shift, Landmark& landmark);

}  // namespace sqslam
