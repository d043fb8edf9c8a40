#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "slam/util/key_index.h"
#include "slam/util/parallel.h"

namespace sqslam {

// Returns the cube of edge 1 that holds a point.
inline std::array<std::int32_t, 3> CubeAt(const Eigen::Array3d& place) {
  const Eigen::Array3d within = place.floor().max(-2147483000.0).min(2147483000.0);
  return {static_cast<std::int32_t>(within.x()), static_cast<std::int32_t>(within.y()),
          static_cast<std::int32_t>(within.z())};
}

// Hash table by integer keys, such as voxel coordinates. Values of one key are merged by Value::Add(const
// Value&). Each of a fixed number of shards takes its values in the order given: content and order do not
// depend on the number of threads.
template <std::size_t kNumbers, typename Value>
class VoxelTable {
 public:
  using Index = KeyIndex<kNumbers>;
  using Key = typename Index::Key;
  static constexpr std::size_t kShards = 16;

  // Adds the values that `give(part, put)` passes to `put(key, value)`, for each part below `parts`, in
  // parallel.
  template <typename Give>
  void Add(std::size_t parts, int threads, const Give& give) {
    using Items = std::vector<std::pair<Key, Value>>;
    std::vector<std::array<Items, kShards>> dealt(parts);
    ParallelFor(parts, threads, [&](std::size_t part) {
      give(part, [&](const Key& key, const Value& value) {
        dealt[part][Index::HashOf(key) % kShards].emplace_back(key, value);
      });
    });
    ParallelFor(kShards, threads, [&](std::size_t shard) {
      auto& [index, values] = shards_[shard];
      for (const auto& of_part : dealt) {
        for (const auto& [key, value] : of_part[shard]) {
          if (const auto [number, fresh] = index.Insert(key); fresh) {
            values.push_back(value);
          } else {
            values[number].Add(value);
          }
        }
      }
    });
  }

  // Returns the value of a key, null if there is none.
  const Value* Find(const Key& key) const {
    const std::uint64_t hash = Index::HashOf(key);
    const auto& [index, values] = shards_[hash % kShards];
    const std::uint32_t number = index.Find(hash, key);
    return number != Index::kNotFound ? &values[number] : nullptr;
  }

  const std::vector<Value>& Values(std::size_t shard) const { return shards_[shard].second; }

 private:
  std::array<std::pair<Index, std::vector<Value>>, kShards> shards_;
};

}  // namespace sqslam
