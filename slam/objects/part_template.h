#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "slam/geometry/solid_iou.h"
#include "slam/geometry/solid_part.h"
#include "slam/objects/size_prior.h"

namespace YAML {
class Node;
}

namespace sqslam {

inline constexpr std::size_t kMaxProportions = 4;
inline constexpr std::size_t kMaxParts = 8;
using Proportions = std::array<double, kMaxProportions>;

// A free proportion with its prior, such as the thickness of a table's top. In [0, 1]; counts in half heights
// of the hull along z, and in half sizes of the hull's narrower side along x and y, so that legs are square.
struct FreeProportion {
  std::string name;
  double mean = 0.0;
  double sigma = 0.1;
};

// A coordinate in the unit box, linear in the proportions: a constant in half sizes of its axis, and slopes.
struct PartCoordinate {
  double constant = 0.0;
  Proportions slopes{};
};

// Returns a coordinate for numbers or Jets. `half`: the hull's half size along its axis; `unit`: what a
// proportion counts in; both in the unit of the result.
template <typename T>
T CoordinateAt(const PartCoordinate& at, const std::array<T, kMaxProportions>& proportions, const T& half,
               const T& unit) {
  T share(0.0);
  for (std::size_t k = 0; k < kMaxProportions; ++k) {
    share += at.slopes[k] * proportions[k];
  }
  return at.constant * half + share * unit;
}

// A part between two coordinates along each axis.
struct TemplatePart {
  std::array<std::array<PartCoordinate, 2>, 3> range;  // x, y, z: low and high
  SolidKind shape = SolidKind::kCuboid;
};

// One way in which the objects of a class consist of parts (`parts` in configs/classes.yaml). The hull is of
// the kind of the first part.
struct PartTemplate {
  double share = 0.4;             // how many of the class are made like this
  int turns = 1;                  // about z that differ: 4 for a chair, whose back is on any side, quarters;
                                  // more for a round body
  bool hangs = false;             // on a wall, say: it cannot stand by itself
  std::optional<SizePrior> size;  // of the hull; empty: that of the class
  std::vector<FreeProportion> free;  // at most kMaxProportions
  std::vector<TemplatePart> parts;   // at most kMaxParts

  // The turns that a hull with corners tells apart.
  int QuarterTurns() const { return std::min(turns, 4); }
  bool IsRound() const { return turns > 4; }
};

// Reads the templates of a class. Throws InputError or UsageError naming source and line.
std::vector<PartTemplate> ReadPartTemplates(const YAML::Node& node, const std::string& source,
                                            const std::string& label);

// Returns the parts of a hull with these half sizes, turned by `turn` quarters about z.
std::vector<SolidPart> PartsWith(const PartTemplate& of, const Proportions& proportions,
                                 const Eigen::Vector3d& half_size, int turn);

}  // namespace sqslam
