#pragma once

#include <optional>
#include <span>
#include <vector>

#include "slam/geometry/superquadric.h"
#include "slam/objects/landmark.h"

namespace sqslam {

// What other landmarks tell of one.
struct Surroundings {
  std::vector<PosedSuperquadric> smaller;  // much smaller ones: what lies in them is not its own
  std::vector<PosedSuperquadric> hiders;   // larger ones that may stand before it: MayHide()
  std::optional<double> hidden_support;    // height of what the nearest of these stands on; it may as well
};

// `shown`: the landmarks that are known well, itself or not. Empty for what has no estimate yet.
Surroundings SurroundingsOf(const Landmark& landmark, std::span<const Landmark* const> shown);

}  // namespace sqslam
