#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <ranges>
#include <utility>
#include <vector>

#include "slam/map/ids.h"

namespace sqslam {

// Returns true for each keypoint with a map point.
inline std::vector<bool> HavePoints(const std::vector<PointId>& points) {
  std::vector<bool> have(points.size());
  std::transform(points.begin(), points.end(), have.begin(), [](PointId p) { return p != kNoPoint; });
  return have;
}

// Values by PointId: constant-time access and iteration in the order of ids. Remembers which id replaced a
// removed one. Keeps eight bytes for each removed id. A reference stays valid until the next Add().
template <typename Value>
class PointTable {
 public:
  void Add(PointId id, Value value) {
    Grow(id + 1);
    if (free_.empty()) {
      entries_[id] = static_cast<std::int64_t>(values_.size());
      values_.push_back(std::move(value));
    } else {
      entries_[id] = free_.back();
      values_[free_.back()] = std::move(value);
      free_.pop_back();
    }
  }

  void Remove(PointId id, PointId replaced_by = kNoPoint) {
    const std::int64_t slot = entries_[id];
    values_[slot] = Value{};
    free_.push_back(slot);
    entries_[id] = replaced_by == kNoPoint ? kGone : kFirstReplaced - replaced_by;
  }

  // Takes over all values and replacements of another table; no id may be alive in both.
  void Absorb(PointTable&& other) {
    Grow(other.IdBound());
    for (PointId id = 0; id < other.IdBound(); ++id) {
      const std::int64_t entry = other.entries_[id];
      if (entry >= 0) {
        Add(id, std::move(other.values_[entry]));
      } else if (entries_[id] == kGone) {
        entries_[id] = entry;
      }
    }
    other = {};
  }

  // Adds a number to every id.
  void RaiseIds(PointId shift) {
    for (std::int64_t& entry : entries_) {
      entry -= entry < kGone ? shift : 0;
    }
    entries_.insert(entries_.begin(), static_cast<std::size_t>(shift), kGone);
  }

  bool IsAlive(PointId id) const { return id >= 0 && id < IdBound() && entries_[id] >= 0; }
  Value& At(PointId id) { return values_[entries_[id]]; }
  const Value& At(PointId id) const { return values_[entries_[id]]; }

  // Follows replacements; kNoPoint if the value is gone. Also ends in a cycle, which a file may hold.
  PointId Resolve(PointId id) const {
    for (PointId step = 0; step < IdBound() && id >= 0 && id < IdBound() && !IsAlive(id); ++step) {
      id = entries_[id] == kGone ? kNoPoint : kFirstReplaced - entries_[id];
    }
    return IsAlive(id) ? id : kNoPoint;
  }

  int Size() const { return static_cast<int>(values_.size() - free_.size()); }  // alive values
  PointId IdBound() const { return static_cast<PointId>(entries_.size()); }     // above every id

  // Validates a table from a file: each value belongs to one id or is free.
  bool IsSound() const {
    std::vector<std::int64_t> used = free_;
    std::ranges::copy_if(entries_, std::back_inserter(used), [](std::int64_t entry) { return entry >= 0; });
    std::ranges::sort(used);
    return std::ranges::equal(used, std::views::iota(std::int64_t{0}, std::int64_t(values_.size())));
  }

  static void VisitState(auto& self, auto&& visit) { visit(self.entries_, self.values_, self.free_); }

  // Returns a table with the same ids and replacements but converted values.
  template <typename Other, typename Convert>
  PointTable<Other> Map(Convert&& convert) const {
    PointTable<Other> result;
    result.entries_ = entries_;
    result.free_ = free_;
    result.values_.reserve(values_.size());
    for (const Value& value : values_) {
      result.values_.push_back(convert(value));
    }
    return result;
  }

  // Iterates over the values that are alive, in the order of ids.
  class Iterator {
   public:
    Iterator(const PointTable* table, PointId id) : table_(table), id_(id) { Skip(); }
    const Value& operator*() const { return table_->At(id_); }
    Iterator& operator++() {
      ++id_;
      Skip();
      return *this;
    }
    bool operator!=(const Iterator& other) const { return id_ != other.id_; }

   private:
    void Skip() {
      while (id_ < table_->IdBound() && !table_->IsAlive(id_)) {
        ++id_;
      }
    }
    const PointTable* table_;
    PointId id_;
  };
  Iterator begin() const { return {this, 0}; }
  Iterator end() const { return {this, IdBound()}; }

 private:
  template <typename Other>
  friend class PointTable;

  static constexpr std::int64_t kGone = -1;
  static constexpr std::int64_t kFirstReplaced = -2;  // -2 - id: replaced by that id

  void Grow(PointId bound) { entries_.resize(static_cast<std::size_t>(std::max(bound, IdBound())), kGone); }

  std::vector<std::int64_t> entries_;  // by id: index into values_, or kGone, or a replacement
  std::vector<Value> values_;
  std::vector<std::int64_t> free_;  // unused indices of values_
};

}  // namespace sqslam
