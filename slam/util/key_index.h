#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace sqslam {

// Hash map from integer keys (cubes of a grid) to 0, 1, ... in the order of their first use. Uses open
// addressing: looking up cubes takes most of the time of building a dense cloud.
template <std::size_t kNumbers>
class KeyIndex {
 public:
  using Key = std::array<std::int32_t, kNumbers>;
  static constexpr std::uint32_t kNotFound = 0xFFFFFFFF;

  explicit KeyIndex(std::size_t expected = 0) : slots_(std::bit_ceil(2 * expected + 64)) {}

  std::size_t Size() const { return size_; }

  // The lowest four bits serve to deal keys to several maps.
  static std::uint64_t HashOf(const Key& key) {
    std::uint64_t hash = 0;
    for (const std::int32_t number : key) {
      hash = (hash ^ static_cast<std::uint32_t>(number)) * 0x9E3779B97F4A7C15ULL;
      hash ^= hash >> 32U;
    }
    return hash;
  }

  // Returns the index of a key, kNotFound if it has none.
  std::uint32_t Find(std::uint64_t hash, const Key& key) const { return slots_[SlotOf(hash, key)].index; }

  // Returns the index of a key, and true if it is a new one.
  std::pair<std::uint32_t, bool> Insert(const Key& key) { return Insert(HashOf(key), key); }
  std::pair<std::uint32_t, bool> Insert(std::uint64_t hash, const Key& key) {
    Slot& slot = slots_[SlotOf(hash, key)];
    if (slot.index != kNotFound) {
      return {slot.index, false};
    }
    slot = {key, size_++};
    const std::uint32_t index = slot.index;
    if (2 * size_ > slots_.size()) {
      const std::vector<Slot> old = std::exchange(slots_, std::vector<Slot>(2 * slots_.size()));
      for (const Slot& moved : old) {
        if (moved.index != kNotFound) {
          slots_[SlotOf(HashOf(moved.key), moved.key)] = moved;
        }
      }
    }
    return {index, true};
  }

  // Inserts keys in turn and calls visit(i, index, is_new) for each. Fetches their slots ahead: memory takes
  // longer than all else.
  void InsertAll(std::span<const Key> keys, auto&& visit) {
    constexpr std::size_t kAhead = 16;
    for (std::size_t next = 0, i = 0; i < keys.size(); ++i) {
      for (; next < std::min(i + kAhead, keys.size()); ++next) {
        __builtin_prefetch(&slots_[FirstSlot(HashOf(keys[next]))]);
      }
      const auto [index, is_new] = Insert(keys[i]);
      visit(i, index, is_new);
    }
  }

 private:
  struct Slot {
    Key key{};
    std::uint32_t index = kNotFound;
  };
  static bool AreEqual(const Key& a, const Key& b) {  // == calls memcmp()
    std::int32_t difference = 0;
    for (std::size_t i = 0; i < kNumbers; ++i) {
      difference |= a[i] ^ b[i];
    }
    return difference == 0;
  }
  std::size_t FirstSlot(std::uint64_t hash) const { return hash >> 4U & (slots_.size() - 1); }
  std::size_t SlotOf(std::uint64_t hash, const Key& key) const {  // the key's slot, or the free one for it
    std::size_t slot = FirstSlot(hash);
    while (slots_[slot].index != kNotFound && !AreEqual(slots_[slot].key, key)) {
      slot = (slot + 1) & (slots_.size() - 1);
    }
    return slot;
  }

  std::vector<Slot> slots_;  // power-of-two size, at most half full, linear probing
  std::uint32_t size_ = 0;
};

}  // namespace sqslam
