#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "slam/scene/distance_field.h"

namespace sqslam {

// The distance from one solid for many points: Newton steps on four points at a time, begun at the nearest
// surface points of a table. Distance and gradient are exact to 1e-6 of the size; where that is not certain,
// DistanceFrom is asked. Pays from 20,000 points on, for exponents of at most 1.
class DistanceTable {
 public:
  // Fills the table with DistanceFrom on `threads` threads (0: one per core).
  explicit DistanceTable(const PosedSuperquadric& solid, int threads = 0);

  // Sets the distances and gradients of points in the map frame.
  void At(std::span<const Eigen::Vector3d> points, std::span<SurfaceDistance> found) const;

 private:
  // Nodes along the distance from the centre, which ends at infinity, and along both ratios of coordinates.
  static constexpr int kNodes = 17;

  struct Block;  // points that are solved together

  std::size_t Index(int face, int shell, int first, int second) const;
  // Sets a point of the first octant and its start; not `solved` if several surface points may be nearest.
  void Begin(const Eigen::Vector3d& p, std::size_t lane, Block& block) const;
  void Solve(Block& block) const;
  bool SolveInside(const Eigen::Vector3d& p, Block& block) const;

  PosedSuperquadric solid_;
  std::vector<std::array<float, 2>> angles_;  // of each node: profile and section
  std::vector<bool> ambiguous_;               // of each cell: several surface points may be nearest
};

}  // namespace sqslam
