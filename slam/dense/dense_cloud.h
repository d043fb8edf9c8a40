#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <unordered_map>
#include <vector>

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
// order of the points follows from the order of the maps.
class CloudFusion {
 public:
  explicit CloudFusion(double spacing);  // edge of the cubes, map units

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

    void Add(const Cell& other);  // what was measured goes before what was filled in
  };

  // Cells by the cubes that they lie in, in the order in which these were met.
  class Grid {
   public:
    explicit Grid(double edge) : edge_(edge) {}
    void Add(const Eigen::Vector3d& p_map, const Cell& cell);
    const std::vector<Cell>& Cells() const { return cells_; }

   private:
    struct KeyHash {
      std::size_t operator()(const std::array<std::int32_t, 3>& key) const;
    };

    double edge_;
    std::unordered_map<std::array<std::int32_t, 3>, std::size_t, KeyHash> places_;
    std::vector<Cell> cells_;
  };

  Grid Flattened() const;

  double spacing_;
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
