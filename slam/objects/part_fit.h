#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "slam/geometry/solid_part.h"
#include "slam/geometry/superquadric.h"
#include "slam/objects/part_template.h"
#include "slam/snapshot/depth_map.h"

namespace sqslam {

// A line of sight that crosses the box of a hull and ends at a surface in the box or behind it.
struct SightLine {
  Eigen::Vector3d origin;     // in the hull's unit box
  Eigen::Vector3d direction;  // from origin + enter * direction to origin + leave * direction in the box
  double enter = 0.0;
  double leave = 0.0;
  double depth = 0.0;  // of the surface, in lengths of the direction
};

// Returns lines of sight through pixels of a depth map in even steps, at most about `most`. Surfaces in front
// of the box are left out.
std::vector<SightLine> SightLinesThrough(const PosedSuperquadric& hull, const DepthMap& map,
                                         std::size_t most);

// The parts of an object, and how much better they explain the lines of sight than its hull does.
struct PartFit {
  std::vector<SolidPart> parts;  // empty: the hull explains them better
  double log_odds = 0.0;         // of the parts, natural logarithm
};

// Fits each template to the lines of sight and returns the best one, if it wins clearly against the hull and
// explains enough of the surfaces in it: parts in a wrong hull explain none.
//
// A line of sight is expected to end at the first solid that it meets, within the noise, or to leave the box
// if it meets none; it may also end at clutter anywhere in the box, or pass through where depth is wrong.
// Neighbouring lines have common errors: all together count as kIndependentLines. Each free proportion costs
// what the Bayesian information criterion says (Schwarz 1978).
PartFit FitParts(const PosedSuperquadric& hull, const std::vector<PartTemplate>& templates,
                 const std::vector<SightLine>& lines);

}  // namespace sqslam
