#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/superquadric.h"
#include "slam/objects/class_priors.h"
#include "slam/objects/landmark.h"

namespace sqslam {

// Other landmarks that matter to the estimation of one.
struct Surroundings {
  std::vector<PosedSuperquadric> smaller;  // much smaller ones: points in them are not its own
  std::vector<PosedSuperquadric> others;   // all of them, which have tops of their own
  std::vector<PosedSuperquadric> hiders;   // larger ones that may hide it: MayHide()
  std::optional<double> hidden_support;    // support of the nearest of these, which it may share
  std::optional<double> top_height;        // height of its top, on which smaller ones stand
  bool holds_larger = false;               // it encloses a better known object of a larger class
};

// Collects the surroundings of a landmark from the shown landmarks, which may include itself. Empty if it has
// no estimate yet.
Surroundings SurroundingsOf(const Landmark& landmark, std::span<const Landmark* const> shown,
                            const ClassPriors& classes);

// True if `other` may hide a part of `object`: it is much larger, so the error of its position matters less,
// and the object does not stand on it: it stands on the floor by its class (`on_floor`), is beside it, or
// reaches below its middle. `points`: the object's inliers. They tell how far down it was seen, which its own
// estimate does not: a cushion on a couch that was once fitted down to the floor would seem hidden by the
// couch and stay there.
bool MayHide(const PosedSuperquadric& other, const PosedSuperquadric& object,
             std::span<const std::pair<std::int64_t, Eigen::Vector3d>> points, bool on_floor = false);

// Returns the edges of a box (undistorted px: left, top, right, bottom) around an object at `depth` (map
// units along the optical axis) that arise because `other` hides the object: just outside the edge the line
// of sight meets `other` first, but not outside the opposite edge. Only an object that hangs above the middle
// of the box can hide just its top edge: if a standing object seems to, the two estimates overlap.
std::array<bool, 4> EdgesHiddenBy(const Box2d& box, double depth, const Rigid3d& T_map_camera,
                                  const Camera& camera, const PosedSuperquadric& other);

// The same for the view's box around `object`.
std::array<bool, 4> HiddenEdges(const BoxView& view, const PosedSuperquadric& object,
                                const PosedSuperquadric& other, const Camera& camera);

// Returns the horizontal way from `p_map` to the middle line of a table, which runs along the table and ends
// as far from its ends as from its sides: what stands at the table faces this way.
Eigen::Vector3d DirectionToTableAxis(const PosedSuperquadric& table, const Eigen::Vector3d& p_map);

}  // namespace sqslam
