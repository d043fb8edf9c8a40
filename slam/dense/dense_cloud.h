#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "slam/dense/voxel_table.h"
#include "slam/snapshot/depth_map.h"

namespace sqslam {

// A point of a surface, map frame.
struct DensePoint {
  Eigen::Vector3f p_map = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  // unit vector to the side from which it was seen
  std::array<std::uint8_t, 3> rgb{};
  std::uint8_t views = 0;  // maximum of other depth maps that confirm it, or kFilledByPlane
  float sigma = 0.0F;      // predicted standard deviation of its distance from the surface, map units
};
using DenseCloud = std::vector<DensePoint>;

// Merges the points of depth maps into one per cube, at their mean, weighted by inverse variances. Depth maps
// that differ by more than a cube would leave several layers of one surface: each point is moved along its
// normal to the mean surface around it, and merged again. Points beside a surface that has far more evidence
// are dropped. The result depends on the order of the maps, not on the number of threads.
class CloudFusion {
 public:
  // `spacing`: edge of the cubes, map units. `threads`: 0 for all hardware threads.
  explicit CloudFusion(double spacing, int threads = 0) : spacing_(spacing), threads_(threads) {}

  void Add(const DepthMap& map);
  DenseCloud Cloud() const;

 private:
  // Sums of the points in a cube, weighted by their inverse variances.
  struct Cell {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    Eigen::Vector3d rgb = Eigen::Vector3d::Zero();
    double weight = 0.0;
    int points = 0;
    int views = 0;       // the most of any point
    bool filled = true;  // no point in it was measured

    Eigen::Vector3d Mean() const { return position / weight; }
    // Returns the standard deviation of one point: those in a cube share most of their errors.
    double Sigma() const { return std::sqrt(points / weight); }
    void Add(const Cell& other);  // measured points replace filled ones
  };
  using Grid = VoxelTable<3, Cell>;

  Grid Flattened() const;

  double spacing_;
  int threads_;
  Grid grid_;
};

// Returns the unit normal of a pixel's surface towards the camera, map frame, from the pixels on both sides
// that show the same surface. Zero if there are none.
Eigen::Vector3d NormalAt(const DepthMap& map, int x, int y);

// dense.ply: binary little-endian PLY with x y z nx ny nz red green blue views sigma. `metres_per_unit`: of a
// cloud in metres, for its comment (UnitComment).
void WriteDenseCloud(const std::filesystem::path& path, const DenseCloud& cloud,
                     double metres_per_unit = 1.0);

// Reads dense.ply. Throws InputError if the file is missing, of another kind or truncated.
DenseCloud ReadDensePoints(const std::filesystem::path& path);

}  // namespace sqslam
