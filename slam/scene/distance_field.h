#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "slam/geometry/superquadric.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Signed Euclidean distance of a point from a surface, negative inside, and its gradient: the unit vector
// away from the nearest surface point.
struct SurfaceDistance {
  double distance = 0.0;
  Eigen::Vector3d gradient = Eigen::Vector3d::UnitZ();
};

// Returns the distance from a solid, exact to 1e-9 of its size. `p_map`: map frame.
SurfaceDistance DistanceFrom(const PosedSuperquadric& solid, const Eigen::Vector3d& p_map);

// Returns the polar angles (profile, section) of the surface point nearest to a point of the object frame's
// first octant.
Eigen::Vector2d NearestAngles(const Superquadric& shape, const Eigen::Vector3d& p_octant);

class DistanceTable;

// The distance from the nearest object of a map.
class DistanceField {
 public:
  // `sigmas`: each object grows along the gradient by so many standard deviations of its centre.
  explicit DistanceField(const MapSnapshot& map, double sigmas = 0.0);

  // Returns infinity for a map without objects.
  SurfaceDistance At(const Eigen::Vector3d& p_map) const;

  // The same for many points, on `threads` threads (0: one per core). `distances` and `gradients` (may be
  // empty) have the size of `points`.
  void At(std::span<const Eigen::Vector3d> points, std::span<double> distances,
          std::span<Eigen::Vector3d> gradients, int threads = 0) const;

 private:
  struct Body {
    PosedSuperquadric solid;
    Eigen::Matrix3d R_object_map;
    Eigen::Vector3d t_object_map;
    Eigen::Matrix3d covariance;  // of the centre, times sigmas squared
    double grown;                // the most by which it grows
  };
  struct Part;

  // Returns a lower bound of the distance: that from the box around the body.
  static double LeastDistance(const Body& body, const Eigen::Vector3d& p_map);
  std::vector<std::unique_ptr<DistanceTable>> MakeTables(std::span<const Eigen::Vector3d> points,
                                                         int threads) const;
  void Solve(const std::vector<std::unique_ptr<DistanceTable>>& tables, Part& part) const;
  void Ask(std::size_t body_index, const DistanceTable* table, Part& part) const;

  std::vector<Body> bodies_;
};

// Distances at the centres of the cells of a grid, x first, then y, then z.
struct DistanceGrid {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // lower corner of the first cell, map frame
  double cell = 0.0;                                 // edge, map units
  std::array<int, 3> size = {0, 0, 0};               // cells along x, y, z
  std::vector<float> distances;
};

// Samples the field around the objects of a map, with a margin on all sides. Throws UsageError if the grid
// would have more than 50 million cells, InputError if the map has no objects.
DistanceGrid SampleDistances(const MapSnapshot& map, double cell, double margin, double sigmas);

// Writes a grid: NAME.npy (float32, [z][y][x]) and NAME.yaml with origin, cell, size and unit.
void WriteDistanceGrid(const std::filesystem::path& path, const DistanceGrid& grid, const MapSnapshot& map);

// Writes the floor plan of a grid in the format of ROS' map_server: NAME.pgm, black where any cell of the
// column is inside an object, and NAME.yaml.
void WriteOccupancyPlan(const std::filesystem::path& path, const DistanceGrid& grid);

}  // namespace sqslam
