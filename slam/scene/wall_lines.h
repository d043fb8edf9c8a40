#pragma once

#include <Eigen/Core>
#include <vector>

namespace sqslam {

// A wall seen from above, in the plan's coordinates.
struct WallLine {
  Eigen::Vector2d from = Eigen::Vector2d::Zero();
  Eigen::Vector2d to = Eigen::Vector2d::Zero();
  double Length() const { return (to - from).norm(); }
};

// Finds the vertical planes of a dense cloud in its plan: lines of columns that are filled over at least half
// of the scene's height, longest first. `points`: x and y in the plan, z up.
std::vector<WallLine> FindWallLines(const std::vector<Eigen::Vector3d>& points);

}  // namespace sqslam
