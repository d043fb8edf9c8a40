#pragma once

#include <limits>

#include "slam/geometry/camera.h"
#include "slam/objects/landmark.h"
#include "slam/objects/object_options.h"

namespace sqslam {

// True if two landmarks are duplicates: rarely boxed apart in the same frame, not mostly boxed in the same
// frames, and either the two-sample t-test on their centroid histories accepts (same label), or their
// superquadrics overlap enough (less if they never appear in one image), or the boxes of the rarer one show
// parts of the other (same label). The association method selects the tests (see AssociationParts);
// MergingOptions::by_test_alone leaves the t-test alone.
bool AreDuplicates(const Landmark& a, const Landmark& b, const ObjectOptions& all, const Camera& camera);

// True if two landmarks fill the same space, once both are refined from all their boxes. Two things cannot,
// so this outweighs frames in which their boxes were apart: one of them may hold boxes of a third. But two
// that most frames show are two: stacked books. Of two labels, each must also explain the other's
// boxes: a detector calls a chair a bench from one side.
bool OccupySamePlace(const Landmark& a, const Landmark& b, const Camera& camera);

// Counts frames, up to `enough`, in which both have a box and the boxes clearly differ: IoU below 0.4 and,
// with `parts_are_one`, neither within the other, as the back of a chair in the chair.
int FramesSeenApart(const Landmark& a, const Landmark& b, bool parts_are_one = false,
                    int enough = std::numeric_limits<int>::max());

// True if more than `more_than` frames have a box of both.
bool AreSeenTogether(const Landmark& a, const Landmark& b, int more_than = 0);

}  // namespace sqslam
