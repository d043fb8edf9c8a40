#include "slam/dense/cloud_pieces.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <unordered_map>
#include <vector>

namespace sqslam {
namespace {

// A cube of space with a power of two as its edge: each cube lies within one of the next level.
struct Cube {
  static constexpr std::int64_t kMost = (1 << 18) - 1;  // coordinates are packed into 19 bits, levels into 7
  static constexpr int kLevels = 64;

  int level = 0;  // log2 of the edge
  std::int64_t x = 0, y = 0, z = 0;

  std::uint64_t Key() const {
    std::uint64_t key = static_cast<std::uint64_t>(std::clamp(level + kLevels, 0, 2 * kLevels - 1));
    for (const std::int64_t place : {x, y, z}) {
      key = key << 19U | static_cast<std::uint64_t>(std::clamp(place, -kMost, kMost) + kMost);
    }
    return key;
  }
  static Cube FromKey(std::uint64_t key) {
    const auto place = [key](unsigned shift) {
      return static_cast<std::int64_t>(key >> shift & 0x7FFFFU) - kMost;
    };
    return {static_cast<int>(key >> 57U) - kLevels, place(38), place(19), place(0)};
  }
  Cube Parent() const { return {level + 1, x >> 1, y >> 1, z >> 1}; }

  // Returns the cube of a pixel's point, 2 to 4 pixels wide at its depth.
  static Cube Of(const DepthMap& map, int u, int v) {
    const double pixel = map.depth.at<float>(v, u) / map.camera.fx;
    const int level = std::ilogb(pixel) + 2;
    const Eigen::Array3d place = (map.PointAt(u, v).array() * std::ldexp(1.0, -level)).floor();
    const auto within = [](double value) {
      return static_cast<std::int64_t>(std::clamp(value, -double(kMost), double(kMost)));
    };
    return {level, within(place.x()), within(place.y()), within(place.z())};
  }
};

constexpr double kPixelsPerCube = 9.0;  // of a surface, on average

template <typename Take>
void ForEachPoint(const DepthMap& map, const Take& take) {
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      if (map.depth.at<float>(y, x) > 0.0F) {
        take(x, y, Cube::Of(map, x, y).Key());
      }
    }
  }
}

}  // namespace

void CloudPieces::Add(const DepthMap& map) {
  std::vector<std::uint64_t> keys;
  ForEachPoint(map, [&keys](int, int, std::uint64_t key) {
    if (keys.empty() || keys.back() != key) {
      keys.push_back(key);
    }
  });
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  const std::lock_guard lock(mutex_);
  cubes_.insert(keys.begin(), keys.end());
}

void CloudPieces::Join(double min_pixels) {
  constexpr int kCoarser = 3;  // levels between connected cubes: one surface seen from different distances
  const std::vector<std::uint64_t> keys(cubes_.begin(), cubes_.end());
  std::unordered_map<std::uint64_t, std::size_t> numbers(2 * keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    numbers.emplace(keys[i], i);
  }
  std::vector<std::size_t> parent(keys.size());  // disjoint sets
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&parent](std::size_t i) {
    while (parent[i] != i) {
      i = parent[i] = parent[parent[i]];
    }
    return i;
  };
  const auto join = [&](std::size_t i, const Cube& other) {
    if (const auto found = numbers.find(other.Key()); found != numbers.end()) {
      parent[root(i)] = root(found->second);
    }
  };
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const Cube cube = Cube::FromKey(keys[i]);
    for (int step = 14; step < 27; ++step) {  // half of the neighbours: the other half join this cube
      join(i, {cube.level, cube.x + step / 9 - 1, cube.y + step / 3 % 3 - 1, cube.z + step % 3 - 1});
    }
    Cube around = cube;
    for (int level = 0; level < kCoarser; ++level) {
      around = around.Parent();
      join(i, around);
    }
  }
  std::vector<int> sizes(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    ++sizes[root(i)];
  }
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (kPixelsPerCube * sizes[root(i)] < min_pixels) {
      cubes_.erase(keys[i]);
    }
  }
}

void CloudPieces::DropSmall(DepthMap& map) const {
  ForEachPoint(map, [&](int x, int y, std::uint64_t key) {
    if (!cubes_.contains(key)) {
      map.depth.at<float>(y, x) = 0.0F;
      map.views.at<std::uint8_t>(y, x) = 0;
    }
  });
}

}  // namespace sqslam
