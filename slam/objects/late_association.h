#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/objects/landmark.h"

namespace sqslam {

// Association at the end of a run, when all poses and the mapped objects are known. While the camera moves in
// wide steps, a box has few map points and its object no estimate yet, so that one object leaves several
// fragments: landmarks of a few boxes, and single boxes that began none.

// Returns the index of the mapped object that the boxes of the fragment show: the one whose projections agree
// with them best, well enough, and that has no other box in the same frames. Empty if there is none.
std::optional<std::size_t> ObjectShownBy(const Landmark& fragment, std::span<const Landmark* const> mapped,
                                         const Camera& camera);

// Returns groups of at least three fragments (indices) that show one object each, those with most boxes
// first: fragments of one label whose boxes, one a frame, have a place and a size in common. Such a place is
// where the lines of sight through the centres of two boxes meet; of all pairs the one whose group is least
// likely to arise by chance is taken, then that of the rest, and so on, until chance explains what is left.
std::vector<std::vector<std::size_t>> GroupsOfOnePlace(std::span<const Landmark* const> fragments,
                                                       const Camera& camera);

struct FragmentAssociation {
  std::vector<std::pair<std::size_t, std::size_t>> shown;  // fragment, and the mapped object that it shows
  std::vector<std::vector<std::size_t>> groups;            // of the rest, that show one object each
};

// Associates the fragments with the mapped objects, and those that show none of them with each other.
FragmentAssociation AssociateFragments(std::span<const Landmark* const> fragments,
                                       std::span<const Landmark* const> mapped, const Camera& camera);

}  // namespace sqslam
