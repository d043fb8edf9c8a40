#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/objects/landmark.h"

namespace sqslam {

// Association at the end of a run, when all poses and the mapped objects are known. While the camera moves in
// wide steps, a box has few map points and its object no estimate yet, so that one object leaves several
// fragments: landmarks of a few boxes, and single boxes that began none.

struct FragmentAssociation {
  std::vector<std::pair<std::size_t, std::size_t>> shown;  // fragment, and the mapped object that it shows
  std::vector<std::vector<std::size_t>> groups;  // of the rest, that show one object each, most boxes first
};

// Associates the fragments with the mapped objects that their boxes show, and the rest with each other.
//
// A fragment shows the object whose projections agree with its boxes best, well enough, and that has no other
// box in the same frames. A group are at least three boxes of one label, one a frame, that have a place and a
// size in common. Such a place is where the lines of sight through the centres of two boxes meet; of all
// pairs the one whose group is least likely to arise by chance is taken, then that of the rest, and so on,
// until chance explains what is left.
FragmentAssociation AssociateFragments(std::span<const Landmark* const> fragments,
                                       std::span<const Landmark* const> mapped, const Camera& camera);

}  // namespace sqslam
