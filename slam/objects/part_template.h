#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "slam/geometry/solid_iou.h"
#include "slam/geometry/solid_part.h"

namespace YAML {
class Node;
}

namespace sqslam {

inline constexpr std::size_t kMaxProportions = 4;
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

// A part between two coordinates along each axis.
struct TemplatePart {
  std::array<std::array<PartCoordinate, 2>, 3> range;  // x, y, z: low and high
  SolidKind shape = SolidKind::kCuboid;
};

// One way in which the objects of a class consist of parts (`parts` in configs/classes.yaml).
struct PartTemplate {
  std::vector<FreeProportion> free;  // 2 to kMaxProportions
  int turns = 1;                     // quarter turns about z to try: 4 for a chair, whose back is on any side
  std::vector<TemplatePart> parts;

  void VisitFields(auto&& visit) { visit("turns", turns, 1, 4); }
};

// Reads the templates of a class. Throws InputError or UsageError naming source and line.
std::vector<PartTemplate> ReadPartTemplates(const YAML::Node& node, const std::string& source,
                                            const std::string& label);

// Returns the parts of a hull with these half sizes, turned by `turn` quarters about z.
std::vector<SolidPart> PartsWith(const PartTemplate& of, const Proportions& proportions,
                                 const Eigen::Vector3d& half_size, int turn);

}  // namespace sqslam
