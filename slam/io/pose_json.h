#pragma once

#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

#include "slam/geometry/rigid3.h"
#include "slam/util/error.h"

namespace sqslam {

// Returns the pose under `key` of a JSON document, a 4x4 matrix: four rows, or 16 numbers row by row. Throws
// InputError if it is not a pose.
template <typename Json>
Rigid3d PoseFromJson(const Json& json, const std::string& key) {
  std::vector<double> v;
  for (const Json& row : json.at(key)) {
    const auto numbers = row.is_array() ? row.template get<std::vector<double>>()
                                        : std::vector<double>{row.template get<double>()};
    v.insert(v.end(), numbers.begin(), numbers.end());
  }
  if (v.size() != 16) {
    throw InputError("expected 16 numbers in " + key);
  }
  Eigen::Matrix3d rotation;
  rotation << v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10];
  if (!(rotation.transpose() * rotation).isIdentity(1e-3) || rotation.determinant() < 0.0) {
    throw InputError("expected a rotation in " + key);
  }
  return {Eigen::Quaterniond(rotation).normalized(), {v[3], v[7], v[11]}};
}

// Returns the rows of a matrix, as JSON files store them.
inline std::array<std::array<double, 4>, 4> RowsOf(const Eigen::Matrix4d& matrix) {
  std::array<std::array<double, 4>, 4> rows;
  Eigen::Matrix<double, 4, 4, Eigen::RowMajor>::Map(rows.front().data()) = matrix;
  return rows;
}

}  // namespace sqslam
