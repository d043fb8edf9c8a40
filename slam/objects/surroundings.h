#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/superquadric.h"
#include "slam/objects/landmark.h"

namespace sqslam {

// Other landmarks that matter to the estimation of one.
struct Surroundings {
  std::vector<PosedSuperquadric> smaller;  // much smaller ones: what lies in them is not its own
  std::vector<PosedSuperquadric> others;   // all of them: they have tops of their own
  std::vector<PosedSuperquadric> hiders;   // larger ones that may stand before it: MayHide()
  std::optional<double> hidden_support;    // height of what the nearest of these stands on; it may as well
  std::optional<double> stood_on;          // height at which smaller ones stand on it: its top
};

// `shown`: the landmarks that are known well, itself or not. Empty for what has no estimate yet.
Surroundings SurroundingsOf(const Landmark& landmark, std::span<const Landmark* const> shown);

// True where `other` may hide a part of `object`: it is much larger, so that its place is known better than
// their sizes differ, and the object does not lie on it: it is beside it, or reaches below its middle.
bool MayHide(const PosedSuperquadric& other, const PosedSuperquadric& object);

// The edges of a box (undistorted px: left, top, right, bottom) around something at `depth` (map units along
// the optical axis) that `other` makes by standing before it: just outside the edge the line of sight meets
// `other` first, and not so outside the opposite edge as well.
std::array<bool, 4> EdgesHiddenBy(const Box2d& box, double depth, const Rigid3d& T_map_camera,
                                  const Camera& camera, const PosedSuperquadric& other);

}  // namespace sqslam
