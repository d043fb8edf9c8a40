#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "slam/estimation/two_view.h"
#include "slam/geometry/camera.h"
#include "slam/io/sequence.h"
#include "slam/io/trajectory.h"
#include "slam/mapping/finished_map.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Evidence of the images on both sides of a step of the path.
enum class StepEvidence {
  kNone,          // they were not compared, or say neither
  kConfirmed,     // their matches agree with the poses
  kCut,           // they show nothing in common
  kContradicted,  // they show the same, but not from where the poses are
};

// A step of the camera that stands out.
struct PathJump {
  std::size_t after = 0;  // pose of the trajectory that the step leads to
  double times = 0.0;     // its speed, in those of the steps around it
  StepEvidence evidence = StepEvidence::kNone;
};

// Returns steps several times as fast as the usual one around them: wrong poses, cuts, or a camera that
// begins to move fast. Only the images can tell.
std::vector<PathJump> FindJumps(const Trajectory& trajectory);

// Judges a step from the image before to the one after by their matches, given the depths (map units) between
// which most of the scene lies: a match agrees with the poses if any depth between these explains it. A step
// is not confirmed if the matches determine another rotation.
StepEvidence JudgeStep(const Camera& camera, const std::vector<TwoViewMatch>& matches,
                       const Rigid3d& T_after_before, double nearest, double farthest);

// Returns the poses (by index) on one side of contradicted jumps: sides alternate from jump to jump, and the
// side with fewer poses is wrong. Empty if no jump is contradicted.
std::vector<std::size_t> PosesThatContradict(const std::vector<PathJump>& jumps, std::size_t num_poses);

// Compares the images of all jumps of a recorded sequence. Jumps that the images confirm are dropped.
std::vector<PathJump> FindDoubtfulJumps(const Sequence& sequence, const Camera& camera,
                                        const MapSnapshot& map, const Trajectory& trajectory);

// Removes poses that the images contradict from a map's trajectories. Returns a warning for every kind of
// jump that the images don't confirm, with the numbers of the frames. A `sequence` without frames (a live
// camera) can't contradict.
std::vector<std::string> CheckPath(const Sequence& sequence, const Camera& camera, FinishedMap& map);

}  // namespace sqslam
