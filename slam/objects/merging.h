#pragma once

#include <limits>

#include "slam/geometry/camera.h"
#include "slam/objects/landmark.h"
#include "slam/objects/object_options.h"

namespace sqslam {

// True where two landmarks are one object: never boxed apart in the same frames, nor mostly boxed in the same
// frames at all, and either the two-sample t-test on their centroid histories accepts (same label), or their
// superquadrics share enough volume (little where they never show in one image), or the boxes of the rarer
// one show parts of the other (same label). The association method decides which of them count (see
// AssociationParts). `objects.method: paper`: the t-test alone.
bool AreSameObject(const Landmark& a, const Landmark& b, const ObjectOptions& all, const Camera& camera);

// Frames in which both have a box and the boxes are clearly two: IoU below 0.4 and, with `parts_are_one`, not
// one within the other, as the back of a chair in the chair. Counts no further than to `enough`.
int FramesSeenApart(const Landmark& a, const Landmark& b, bool parts_are_one = false,
                    int enough = std::numeric_limits<int>::max());

}  // namespace sqslam
