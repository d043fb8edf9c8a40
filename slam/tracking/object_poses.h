#pragma once

#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/objects/detection_filter.h"
#include "slam/objects/object_types.h"

namespace sqslam {

// Returns up to `count` rough poses T_camera_map from which the shown landmarks would appear in the boxes of
// their labels, best first, each with different landmarks in the boxes. Needs three boxes of known objects.
//
// P3P treats the centres of three boxes as those of the solids (Zins, Simon and Berger, "OA-SLAM: Leveraging
// Objects for Camera Relocalization in Visual SLAM", ISMAR 2022); poses whose projected solids overlap all
// boxes best are refined by the edges of the boxes.
std::vector<Rigid3d> PosesFromObjects(const std::vector<BoxCandidate>& boxes, const ObjectMapView& objects,
                                      const Camera& camera, int count);

}  // namespace sqslam
