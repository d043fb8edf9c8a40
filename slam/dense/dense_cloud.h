#pragma once

#include <Eigen/Core>
#include <array>
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
  std::uint8_t views = 0;  // most depth maps that agree in it beside their own, or kFilledByPlane
};
using DenseCloud = std::vector<DensePoint>;

// Gathers the points of depth maps in cubes and makes one point of each cube, at the mean of those in it.
// Depth maps that differ by more than a cube would leave several layers of one surface: each point is carried
// along its normal to the mean surface about it, and what then falls into one cube becomes one point. The
// points and their order follow from the order of the maps, whatever the number of threads.
class CloudFusion {
 public:
  // `spacing`: edge of the cubes, map units. `threads`: 0 for as many as the machine runs at a time.
  explicit CloudFusion(double spacing, int threads = 0) : spacing_(spacing), threads_(threads) {}

  void Add(const DepthMap& map);
  DenseCloud Cloud() const;

 private:
  // Weighted sums of the points in a cube.
  struct Cell {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    Eigen::Vector3d rgb = Eigen::Vector3d::Zero();
    double weight = 0.0;
    int views = 0;       // the most that agree
    bool filled = true;  // no point of it was measured

    Eigen::Vector3d Mean() const { return position / weight; }
    void Add(const Cell& other);  // what was measured goes before what was filled in
  };
  using Grid = VoxelTable<3, Cell>;

  Grid Flattened() const;

  double spacing_;
  int threads_;
  Grid grid_;
};

// Unit normal of a pixel's surface, towards the camera, map frame: across the pixels on both sides of it, as
// far as their depths show one surface. Zero where they do not.
Eigen::Vector3d NormalAt(const DepthMap& map, int x, int y);

// dense.ply: binary little-endian PLY with x y z nx ny nz red green blue views.
void WriteDenseCloud(const std::filesystem::path& path, const DenseCloud& cloud);

// Reads such a file back. Throws InputError where it is missing, is none of these, or is cut off.
DenseCloud ReadDensePoints(const std::filesystem::path& path);

}  // namespace sqslam
