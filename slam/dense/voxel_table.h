#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "slam/util/parallel.h"

namespace sqslam {

// Hash table by integer keys, such as voxel coordinates. Values of one key are merged by Value::Add(const
// Value&). Each of a fixed number of shards takes its values in the order given: content and order do not
// depend on the number of threads.
template <std::size_t kNumbers, typename Value>
class VoxelTable {
 public:
  using Key = std::array<std::int32_t, kNumbers>;
  static constexpr std::size_t kShards = 16;

  // Adds the values that `give(part, put)` passes to `put(key, value)`, for each part below `parts`, in
  // parallel.
  template <typename Give>
  void Add(std::size_t parts, int threads, const Give& give) {
    std::vector<std::array<std::vector<Item>, kShards>> dealt(parts);
    ParallelFor(parts, threads, [&](std::size_t part) {
      give(part, [&](const Key& key, const Value& value) {
        const std::uint64_t hash = HashOf(key);
        dealt[part][hash % kShards].push_back({hash, key, value});
      });
    });
    ParallelFor(kShards, threads, [&](std::size_t shard) {
      for (const auto& of_part : dealt) {
        const std::vector<Item>& items = of_part[shard];
        for (std::size_t i = 0; i < items.size(); ++i) {
          if (i + kAhead < items.size()) {
            shards_[shard].Fetch(items[i + kAhead].hash);
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
      hashes[i] = HashOf(keys[i]);
      shards_[hashes[i] % kShards].Fetch(hashes[i]);
    }
    std::array<const Value*, kKeys> values{};
    for (std::size_t i = 0; i < kKeys; ++i) {
      const Shard& shard = shards_[hashes[i] % kShards];
      const std::uint32_t number =
          shard.slots.empty() ? kNone : shard.slots[shard.SlotOf(hashes[i], keys[i])].number;
      if (number != kNone) {
        values[i] = &shard.values[number];
        FetchMemory(values[i]);
      }
    }
    return values;
  }

  const std::vector<Value>& Values(std::size_t shard) const { return shards_[shard].values; }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;
  static constexpr std::size_t kAhead = 8;  // items whose slots are prefetched
  static void FetchMemory(const void* place) { __builtin_prefetch(place); }

  struct Item {
    std::uint64_t hash;
    Key key;
    Value value;
  };
  struct Slot {
    Key key{};
    std::uint32_t number = kNone;  // of the value
  };
  struct Shard {
    std::vector<Slot> slots;  // power-of-two size, at most half full, linear probing
    std::vector<Value> values;

    std::size_t FirstSlot(std::uint64_t hash) const { return hash / kShards & (slots.size() - 1); }
    std::size_t SlotOf(std::uint64_t hash, const Key& key) const {
      std::size_t slot = FirstSlot(hash);
      while (slots[slot].number != kNone && slots[slot].key != key) {
        slot = (slot + 1) & (slots.size() - 1);
      }
      return slot;
    }
    void Fetch(std::uint64_t hash) const {
      if (!slots.empty()) {
        FetchMemory(&slots[FirstSlot(hash)]);
      }
    }
    void Take(const Item& item) {
      if (2 * values.size() >= slots.size()) {
        Grow();
      }
      Slot& slot = slots[SlotOf(item.hash, item.key)];
      if (slot.number == kNone) {
        slot = {item.key, static_cast<std::uint32_t>(values.size())};
        values.push_back(item.value);
      } else {
        values[slot.number].Add(item.value);
      }
    }
    void Grow() {
      constexpr std::size_t kFirst = 64;
      const std::vector<Slot> old =
          std::exchange(slots, std::vector<Slot>(std::max(kFirst, 2 * slots.size())));
      for (const Slot& slot : old) {
        if (slot.number != kNone) {
          slots[SlotOf(HashOf(slot.key), slot.key)] = slot;
        }
      }
    }
  };

  static std::uint64_t HashOf(const Key& key) {
    std::uint64_t hash = 0;
    for (const std::int32_t number : key) {
      hash = (hash ^ static_cast<std::uint32_t>(number)) * 0x9E3779B97F4A7C15ULL;
      hash ^= hash >> 32U;
    }
    return hash;
  }

  std::array<Shard, kShards> shards_;
};

}  // namespace sqslam
