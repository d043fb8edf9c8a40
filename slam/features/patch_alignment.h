#pragma once

#include <Eigen/Core>
#include <optional>

#include "slam/features/frame_features.h"

namespace sqslam {

// Place in a patch: px of its level, relative to its middle pixel.
struct PatchPlace {
  const KeypointPatch* patch = nullptr;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

// Finds the pixel of `current` that shows what `reference` shows: inverse compositional Lucas-Kanade (Baker
// and Matthews 2004) over 9x9 pixels, with a gain and an offset of the brightness. `A_reference_current`
// takes steps in `current` to steps in `reference`. Returns the pixel in `current.patch`, or nothing: if the
// window leaves a patch, has too little texture along some direction, moves by more than two pixels, or
// looks different.
std::optional<Eigen::Vector2d> AlignPatches(const PatchPlace& reference, const PatchPlace& current,
                                            const Eigen::Matrix2d& A_reference_current);

}  // namespace sqslam
