#include "slam/dense/dense_cloud.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>

#include "slam/util/atomic_file.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is written in the machine's byte order");

// Vector along the surface between the pixels at (dx, dy) before and after this one, or from it to the one
// that shows the same surface; zero where neither does.
Eigen::Vector3d Tangent(const DepthMap& map, int x, int y, int dx, int dy) {
  constexpr double kSteepest = 5.0;  // tangent of a surface's slope: a greater step is another surface
  const double z = map.depth.at<float>(y, x);
  const double step = kSteepest * std::max(dx, dy) / map.camera.fx * z;
  const auto shows = [&](int u, int v) {
    return u >= 0 && v >= 0 && u < map.depth.cols && v < map.depth.rows && map.depth.at<float>(v, u) > 0.0F &&
           std::abs(map.depth.at<float>(v, u) - z) <= step;
  };
  const bool before = shows(x - dx, y - dy);
  const bool after = shows(x + dx, y + dy);
  if (!before && !after) {
    return Eigen::Vector3d::Zero();
  }
  return map.PointAt(after ? x + dx : x, after ? y + dy : y) -
         map.PointAt(before ? x - dx : x, before ? y - dy : y);
}

std::uint8_t Rounded(double value) {
  return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
}

std::string HeaderOf(std::size_t points) {
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment map frame, z up; views {}: filled by a plane\n"
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar views\nend_header\n",
      kFilledByPlane, points);
}

}  // namespace

Eigen::Vector3d NormalAt(const DepthMap& map, int x, int y) {
  constexpr int kReach = 2;  // pixels: noise of the depth counts less than next to the pixel
  const Eigen::Vector3d normal = Tangent(map, x, y, kReach, 0).cross(Tangent(map, x, y, 0, kReach));
  const double length = normal.norm();
  if (!(length > 0.0)) {
    return Eigen::Vector3d::Zero();
  }
  const bool towards = normal.dot(map.T_map_camera.translation - map.PointAt(x, y)) > 0.0;
  return normal / (towards ? length : -length);
}

CloudFusion::CloudFusion(double spacing) : spacing_(spacing) {}

std::size_t CloudFusion::KeyHash::operator()(const std::array<std::int32_t, 3>& key) const {
  std::uint64_t hash = 0;
  for (const std::int32_t coordinate : key) {
    hash = (hash ^ static_cast<std::uint32_t>(coordinate)) * 0x9E3779B97F4A7C15ULL;
    hash ^= hash >> 32U;
  }
  return hash;
}

void CloudFusion::Add(const DepthMap& map) {
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      const double z = map.depth.at<float>(y, x);
      if (!(z > 0.0)) {
        continue;
      }
      const Eigen::Vector3d p_map = map.PointAt(x, y);
      std::array<std::int32_t, 3> key{};
      for (int i = 0; i < 3; ++i) {
        key[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(
            std::clamp(std::floor(p_map[i] / spacing_), -2147483000.0, 2147483000.0));
      }
      const auto [place, is_new] = places_.try_emplace(key, cells_.size());
      if (is_new) {
        cells_.emplace_back();
      }
      Cell& cell = cells_[place->second];
      const std::uint8_t views = map.views.at<std::uint8_t>(y, x);
      if (views != kFilledByPlane && cell.filled) {
        cell = Cell();  // what was measured goes before what was filled in
        cell.filled = false;
      } else if (views == kFilledByPlane && !cell.filled) {
        continue;
      }
      const double weight = 1.0 / (z * z);
      const cv::Vec3b& bgr = map.bgr.at<cv::Vec3b>(y, x);
      cell.position += weight * p_map;
      cell.normal += weight * NormalAt(map, x, y);
      cell.rgb += weight * Eigen::Vector3d(bgr[2], bgr[1], bgr[0]);
      cell.weight += weight;
      cell.views = std::max<int>(cell.views, views);
    }
  }
}

DenseCloud CloudFusion::Cloud() const {
  DenseCloud cloud;
  cloud.reserve(cells_.size());
  for (const Cell& cell : cells_) {
    const double length = cell.normal.norm();
    DensePoint point;
    point.p_map = (cell.position / cell.weight).cast<float>();
    point.normal = (length > 0.0 ? cell.normal / length : cell.normal).cast<float>();
    for (int i = 0; i < 3; ++i) {
      point.rgb[static_cast<std::size_t>(i)] = Rounded(cell.rgb[i] / cell.weight);
    }
    point.views = static_cast<std::uint8_t>(cell.views);
    cloud.push_back(point);
  }
  return cloud;
}

void WriteDenseCloud(const std::filesystem::path& path, const DenseCloud& cloud) {
  std::string bytes = HeaderOf(cloud.size());
  const auto append = [&bytes](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  for (const DensePoint& point : cloud) {
    for (const Eigen::Vector3f* vector : {&point.p_map, &point.normal}) {
      for (int i = 0; i < 3; ++i) {
        append((*vector)[i]);
      }
    }
    append(point.rgb);
    append(point.views);
  }
  WriteFileAtomically(path, bytes);
}

DenseCloud ReadDensePoints(const std::filesystem::path& path) {
  constexpr std::size_t kPointBytes = 28;
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  const std::size_t count_at = bytes.find("element vertex ");
  const std::size_t points =
      count_at == std::string::npos
          ? 0
          : static_cast<std::size_t>(std::strtoull(bytes.c_str() + count_at + 15, nullptr, 10));
  const std::string header = HeaderOf(points);
  if (!bytes.starts_with(header) || bytes.size() != header.size() + kPointBytes * points) {
    throw InputError(fmt::format("{}: expected a dense.ply as sqslam densify writes it", path.string()));
  }
  DenseCloud cloud(points);
  const char* at = bytes.data() + header.size();
  const auto take = [&at](void* value, std::size_t size) {
    std::memcpy(value, at, size);
    at += size;
  };
  for (DensePoint& point : cloud) {
    take(point.p_map.data(), 3 * sizeof(float));
    take(point.normal.data(), 3 * sizeof(float));
    take(point.rgb.data(), point.rgb.size());
    take(&point.views, 1);
  }
  return cloud;
}

}  // namespace sqslam
