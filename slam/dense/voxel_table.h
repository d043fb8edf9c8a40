#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "slam/util/key_index.h"
#include "slam/util/parallel.h"

namespace sqslam {

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
    std::vector<std::array<std::vector<Item>, kShards>> dealt(parts);
    ParallelFor(parts, threads, [&](std::size_t part) {
      give(part, [&](const Key& key, const Value& value) {
        const std::uint64_t hash = Index::HashOf(key);
        dealt[part][hash % kShards].push_back({hash, key, value});
      });
    });
    ParallelFor(kShards, threads, [&](std::size_t shard) {
      for (const auto& of_part : dealt) {
        const std::vector<Item>& items = of_part[shard];
        for (std::size_t i = 0; i < items.size(); ++i) {
          if (i + kAhead < items.size()) {
            shards_[shard].index.Prefetch(items[i + kAhead].hash);
          }
          shards_[shard].Take(items[i]);
        }
      }
    });
  }

  // Returns the values of some keys, null for missing ones. Prefetches all slots before the first is needed.
  template <std::size_t kKeys>
  std::array<const Value*, kKeys> Find(const std::array<Key, kKeys>& keys) const {
    std::array<std::uint64_t, kKeys> hashes;
    for (std::size_t i = 0; i < kKeys; ++i) {
      hashes[i] = Index::HashOf(keys[i]);
      shards_[hashes[i] % kShards].index.Prefetch(hashes[i]);
    }
    std::array<const Value*, kKeys> values{};
    for (std::size_t i = 0; i < kKeys; ++i) {
      const Shard& shard = shards_[hashes[i] % kShards];
      if (const std::uint32_t number = shard.index.Find(hashes[i], keys[i]); number != Index::kNone) {
        values[i] = &shard.values[number];
        __builtin_prefetch(values[i]);
      }
    }
    return values;
  }

  const std::vector<Value>& Values(std::size_t shard) const { return shards_[shard].values; }

 private:
  static constexpr std::size_t kAhead = 8;  // items whose slots are prefetched

  struct Item {
    std::uint64_t hash;
    Key key;
    Value value;
  };
  struct Shard {
    Index index;
    std::vector<Value> values;

    void Take(const Item& item) {
      if (const auto [number, fresh] = index.Insert(item.hash, item.key); fresh) {
        values.push_back(item.value);
      } else {
        values[number].Add(item.value);
      }
    }
  };

  std::array<Shard, kShards> shards_;
};

}  // namespace sqslam
