#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace sqslam {

struct PointCloud {
  std::vector<Eigen::Vector3d> points;           // in the file's unit and order
  std::vector<std::array<std::uint8_t, 3>> rgb;  // one per point, or none if the file has no colours
  std::vector<Eigen::Vector3d> normals;          // unit vectors, likewise
  std::vector<double> sigmas;                    // standard deviations, likewise
  // Points that are not finite (holes of a depth image) or farther away than kMaxMapUnits.
  int skipped = 0;
};

// Reads a PLY file (ascii or binary of either byte order; x, y, z of the element `vertex` in any scalar type
// and order, its normals if it has nx, ny and nz, its standard deviations if it has sigma, and its colours if
// it has red, green and blue, as integers of 8 or 16 bits or as floating-point numbers up to 1 or up to 255;
// other elements are ignored), or a text file with x y z at the start of each line (separated by blanks,
// tabs, commas or semicolons; # comments; optional header line). Throws InputError that names the file, the
// line (in a binary body the byte) and what was expected.
PointCloud ReadPointCloud(const std::filesystem::path& path);

}  // namespace sqslam
