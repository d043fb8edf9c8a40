#pragma once

#include <algorithm>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include "slam/map/ids.h"
#include "slam/map/shared_pages.h"

namespace sqslam {

// Returns true for each keypoint with a map point.
inline std::vector<bool> HavePoints(const std::vector<PointId>& points) {
  std::vector<bool> have(points.size());
  std::transform(points.begin(), points.end(), have.begin(), [](PointId p) { return p != kNoPoint; });
  return have;
}

// Values by PointId: constant-time access, iteration in the order of ids, and memory in proportion to the
// values that are alive. Remembers what replaced a removed id, in memory that converted copies share. A
// reference stays valid until the next Add().
template <typename Value>
class PointTable {
 public:
  void Add(PointId id, Value value) {
    entries_.Grow(static_cast<std::size_t>(id) + 1);
    if (free_.empty()) {
      entries_.Set(id, static_cast<std::int64_t>(values_.size()));
      values_.push_back(std::move(value));
    } else {
      entries_.Set(id, free_.back());
      values_[free_.back()] = std::move(value);
      free_.pop_back();
    }
  }

  void Remove(PointId id, PointId replaced_by = kNoPoint) {
    const std::int64_t slot = entries_[id];
    values_[slot] = Value{};
    free_.push_back(slot);
    entries_.Set(id, replaced_by == kNoPoint ? kGone : kFirstReplaced - replaced_by);
    if (replaced_by != kNoPoint) {
      replaced_.push_back(id);
    }
  }

  // Drops the replacements of the ids from `first` on, which must not have been published yet. Call it before
  // any later id is published: it looks only at the ids replaced since the last call.
  void ForgetReplacedFrom(PointId first) {
    for (const PointId id : replaced_) {
      if (id < first) {
        const PointId last = Resolve(id);
        entries_.Set(id, last == kNoPoint ? kGone : kFirstReplaced - last);
      }
    }
    for (const PointId id : replaced_) {
      if (id >= first) {
        entries_.Set(id, kGone);
      }
    }
    replaced_.clear();
  }

  // Takes over all values and replacements of another table; no id may be alive in both.
  void Absorb(PointTable&& other) {
    entries_.Grow(other.entries_.size());
    for (std::size_t i = 0; i < other.entries_.size(); ++i) {
      const std::int64_t entry = other.entries_[i];
      if (entry >= 0) {
        Add(static_cast<PointId>(i), std::move(other.values_[entry]));
      } else if (entry <= kFirstReplaced && entries_[i] == kGone) {
        entries_.Set(i, entry);
      }
    }
    other = {};
  }

  bool IsAlive(PointId id) const {
    return id >= 0 && id < static_cast<PointId>(entries_.size()) && entries_[id] >= 0;
  }
  Value& At(PointId id) { return values_[entries_[id]]; }
  const Value& At(PointId id) const { return values_[entries_[id]]; }

  // Follows replacements; kNoPoint if the value is gone.
  PointId Resolve(PointId id) const {
    while (id >= 0 && id < static_cast<PointId>(entries_.size())) {
      const std::int64_t entry = entries_[id];
      if (entry >= 0) {
        return id;
      }
      id = entry == kGone ? kNoPoint : kFirstReplaced - entry;
    }
    return kNoPoint;
  }

  int Size() const { return static_cast<int>(values_.size() - free_.size()); }  // alive values
  int Slots() const { return static_cast<int>(values_.size()); }                // allocated values
  // Validates a table from untrusted bytes: every id leads to one value or to none, every value has an id.
  bool IsSound() const {
    std::vector<bool> used(values_.size());
    const auto use = [&used](std::int64_t slot) {
      const bool fresh = slot >= 0 && slot < static_cast<std::int64_t>(used.size()) && !used[slot];
      if (fresh) {
        used[slot] = true;
      }
      return fresh;
    };
    std::vector<bool> ends(entries_.size());  // replacements without a cycle
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      if (entries_[i] >= 0 && !use(entries_[i])) {
        return false;
      }
      std::vector<std::size_t> way;
      for (std::size_t id = i; !ends[id];) {
        way.push_back(id);
        const std::int64_t next = kFirstReplaced - entries_[id];
        if (entries_[id] >= kGone) {
          break;
        }
        if (next >= IdBound() || way.size() > entries_.size()) {
          return false;
        }
        id = static_cast<std::size_t>(next);
      }
      for (const std::size_t id : way) {
        ends[id] = true;
      }
    }
    return std::ranges::all_of(free_, use) && std::ranges::find(used, false) == used.end();
  }

  PointId IdBound() const { return static_cast<PointId>(entries_.size()); }  // above every id

  static void VisitState(auto& self, auto&& visit) {
    std::vector<std::int64_t> entries = self.entries_.All();
    visit(entries, self.values_, self.free_);
    if constexpr (!std::is_const_v<std::remove_reference_t<decltype(self)>>) {
      self.entries_ = SharedPages<std::int64_t, kGone>(entries);
      self.replaced_.clear();
    }
  }

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

  SharedPages<std::int64_t, kGone> entries_;  // by id: index into values_, or kGone, or a replacement
  std::vector<Value> values_;
  std::vector<std::int64_t> free_;  // unused indices of values_
  std::vector<PointId> replaced_;   // since the last ForgetReplacedFrom()
};

}  // namespace sqslam
