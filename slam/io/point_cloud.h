#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace sqslam {

struct PointCloud {
  std::vector<Eigen::Vector3d> points;           // in the file's unit and order
  std::vector<std::array<std::uint8_t, 3>> rgb;  // as many as points, or none where the file has no colours
  int skipped = 0;  // points of the file that are not finite (holes of a depth image)
};

// Reads a PLY file (ascii, binary of either byte order; x, y, z of the element `vertex` in any scalar type
// and any place among its properties, its colours where it has red, green and blue, as whole numbers of 8 or
// 16 bits or as real numbers up to 1 or up to 255; other elements are passed over), or a text file with x y z
// at the start of each line (blanks, tabs, commas or semicolons between numbers; # comments; a first line of
// names). Throws InputError that names the file, the line (in a binary body the byte) and what was expected.
PointCloud ReadPointCloud(const std::filesystem::path& path);

}  // namespace sqslam
