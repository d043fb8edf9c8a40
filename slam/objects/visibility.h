#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/superquadric.h"
#include "slam/objects/landmark.h"
#include "slam/objects/object_options.h"

// Which edges of an object's box are its silhouette, and what ends the box at the others.
//
// An edge is cut if it lies at the image border, and hidden if an occluder is beside it: the box of another
// detection, or a mapped object in front. Detections are judged when they are seen. The views of a
// landmark are judged again at each estimation, as an occluder may not have been mapped at first.
namespace sqslam {

// One flag for each edge of a box, see BoxEdge.
using EdgeFlags = std::array<bool, 4>;

// The edges at which a box may end before the object does.
struct BoxEdges {
  EdgeFlags cut{};     // the image ends there
  EdgeFlags hidden{};  // another object hides the end

  void Hide(const EdgeFlags& more);
  EdgeFlags Free() const;
  bool AnyCut() const;
};

// Returns true if the box shows the whole object.
bool IsWhole(const EdgeFlags& edge_free);

// Returns the edges of a box (distorted px) that the image border cuts off. Detectors end such a box short of
// the border, by a share of its size.
EdgeFlags CutEdges(const Box2d& box, const Camera& camera, const DetectionFilterOptions& options);

// A box of a frame (distorted px) with the depths of the points in it, map units.
struct BoxAtDepth {
  Box2d box;
  double median_depth = 0.0;  // 0: unknown
  double near_depth = 0.0;    // the lower quartile
};

// Returns the edges of each box that nearer boxes of the same frame hide.
std::vector<EdgeFlags> EdgesHiddenByBoxes(std::span<const BoxAtDepth> boxes);

// True if the volume of `other` is at least four times that of the object.
bool IsMuchLarger(const Superquadric& other, const Superquadric& object);

// True if `other` may hide a part of `object`: it is much larger, so the error of its position matters less,
// and the object does not stand on it: it stands on the floor by its class (`on_floor`), is beside it, or
// reaches below its middle.
bool MayOcclude(const PosedSuperquadric& other, const PosedSuperquadric& object, bool on_floor = false);

// Returns the edges of the object's box (distorted px) that arise because `other` hides the object: just
// outside the edge the line of sight meets `other` first, but not outside the opposite edge. Only an object
// that hangs above the middle of the box can hide just its top edge: if a standing object seems to, the two
// estimates overlap.
EdgeFlags EdgesHiddenBy(const PosedSuperquadric& other, const PosedSuperquadric& object, const Box2d& box,
                        const Rigid3d& T_map_camera, const Camera& camera);

// Judges the edges of an object's views again: those that seemed hidden by the box of a mapped object beneath
// it are free, as the bottom of a screen on a desk, unless the solid of an occluder hides them.
void JudgeHiddenEdges(const PosedSuperquadric& object, std::span<const Landmark* const> beneath,
                      std::span<const PosedSuperquadric> occluders, const Camera& camera,
                      const DetectionFilterOptions& options, std::vector<BoxView>& views);

// Returns the one of the other objects that hides the lower edge in the most views of the landmark's visible
// part; null if none hides it in half of them.
const PosedSuperquadric* OccluderOfBottom(const Landmark& landmark, bool on_floor,
                                          std::span<const PosedSuperquadric> others,
                                          const std::vector<BoxView>& views, const Camera& camera);

// True if the lower box edges show where the object ends. If they are hidden in most views, the other views
// probably missed the occluder.
bool IsBottomSeen(const std::vector<BoxView>& views);

// Returns the edges at which the object ends: the free ones, without the lower one if the views of the object
// do not show its bottom.
EdgeFlags ExactEdges(const BoxView& view, bool bottom_seen);

}  // namespace sqslam
