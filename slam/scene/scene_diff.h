#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/snapshot/depth_map.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Fate of an object between two maps of one place. An object that only one of them holds is gone or
// new if the other one shows its place empty, and not seen otherwise.
enum class Change { kStayed, kMoved, kResized, kGone, kNew, kNotSeen };
constexpr auto EnumNames(Change) {
  return std::array{"stayed", "moved", "resized", "gone", "new", "not seen"};
}

// Returns true for a change that has been observed.
inline bool IsChange(Change change) { return change != Change::kStayed && change != Change::kNotSeen; }

struct ObjectChange {
  Change change = Change::kStayed;
  int before = -1;                                  // index of the object in the first map; -1: it has none
  int after = -1;                                   // and in the second
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  // of the centre, in frame and unit of the first map
  double size_ratio = 1.0;                          // geometric mean of the sizes after over that before
  double significance = 0.0;                        // of a shift or new size, in standard deviations
};

// One map of a pair with what its camera saw. Copies of depth maps share their images.
struct SeenScene {
  const MapSnapshot* map = nullptr;
  std::vector<DepthMap> depths;  // of the keyframes; may be empty
};

// Compares the reliable objects of two maps. `S_first_second` transforms the second map into the first.
// Objects are paired by overlap, then by label, size and distance; the pairs that stayed refine the
// alignment. A shift is significant if it exceeds 3.4 standard deviations of both objects and the alignment,
// and a hundredth of the objects' mean distance from the cameras.
//
// A place is empty if the depth maps of at least two keyframes look through it. Without depth maps: if five
// keyframes have all of it in view, with no other object before it. A thin thing that depth maps do not
// resolve counts as not seen.
std::vector<ObjectChange> CompareScenes(const SeenScene& first, const SeenScene& second,
                                        const Sim3d& S_first_second);

}  // namespace sqslam
