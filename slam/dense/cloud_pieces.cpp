#include "slam/dense/cloud_pieces.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "slam/util/disjoint_sets.h"

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
  std::ranges::sort(keys);
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  const std::lock_guard lock(mutex_);
  cubes_.insert(keys.begin(), keys.end());
}

void CloudPieces::Join(double min_pixels) {
  constexpr int kCoarser = 3;  // levels between connected cubes: one surface seen from different distances
  const std::vector<std::uint64_t> keys(cubes_.begin(), cubes_.end());
  const auto count = static_cast<std::int32_t>(keys.size());
  std::unordered_map<std::uint64_t, std::int32_t> numbers(2 * keys.size());
  for (std::int32_t i = 0; i < count; ++i) {
    numbers.emplace(keys[i], i);
  }
  DisjointSets sets(keys.size());
  const auto join = [&](std::int32_t i, const Cube& other) {
    if (const auto found = numbers.find(other.Key()); found != numbers.end()) {
      sets.Join(i, found->second);
    }
  };
  for (std::int32_t i = 0; i < count; ++i) {
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
  for (std::int32_t i = 0; i < count; ++i) {
    ++sizes[sets.Root(i)];
  }
  for (std::int32_t i = 0; i < count; ++i) {
    if (kPixelsPerCube * sizes[sets.Root(i)] < min_pixels) {
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
