#pragma once

#include <optional>

#include "slam/geometry/camera.h"
#include "slam/geometry/superquadric.h"
#include "slam/objects/landmark.h"
#include "slam/objects/object_options.h"
#include "slam/snapshot/object_account.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Returns why the landmark says nothing about others yet; empty if it does.
std::optional<LeftOut> WhyNotShown(const Landmark& landmark, const ObjectOptions& options);
inline bool IsShown(const Landmark& landmark, const ObjectOptions& options) {
  return !WhyNotShown(landmark, options);
}

// Returns why the object does not appear in the map; empty if it does. Those left out are kept, as more boxes
// may still make sense of them.
std::optional<LeftOut> WhyLeftOut(const Landmark& landmark, const ObjectOptions& options);

// Returns the landmark in the chosen representation; empty if it is left out.
std::optional<PosedSuperquadric> Represented(const Landmark& landmark, const ObjectOptions& options);

// Returns the landmark as an object of the map; empty if it is left out. Its covariance is zero for
// representations other than the refined superquadric. `camera`: of the last estimation, if there was one.
std::optional<SnapshotObject> ShownObject(const Landmark& landmark, const std::optional<Camera>& camera,
                                          const ObjectOptions& options);

}  // namespace sqslam
