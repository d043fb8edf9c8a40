#pragma once

#include <algorithm>
#include <cstddef>
#include <type_traits>
#include <vector>

#include "slam/util/atomic_file.h"

namespace sqslam {

// Rows by number, of which only the newest are in memory and the others in a temporary file, or in memory too
// if the file cannot be written. Reading neighbours in turn is cheap. For one thread at a time.
template <typename Row>
requires(std::is_trivially_copyable_v<Row>) class SpilledRows {
 public:
  int Size() const { return spilled_ + static_cast<int>(rows_.size()); }

  void Add(const Row& row) {
    rows_.push_back(row);
    if (rows_.size() >= kPage && file_.Append(rows_.data(), rows_.size() * sizeof(Row))) {
      spilled_ += static_cast<int>(rows_.size());
      rows_.clear();
    }
  }

  Row operator[](int number) const {
    if (number >= spilled_) {
      return rows_[static_cast<std::size_t>(number - spilled_)];
    }
    if (cached_.empty() || number < first_cached_ ||
        number >= first_cached_ + static_cast<int>(cached_.size())) {
      first_cached_ = number - number % kCached;
      cached_.resize(static_cast<std::size_t>(std::min(kCached, spilled_ - first_cached_)));
      file_.Read(static_cast<std::size_t>(first_cached_) * sizeof(Row), cached_.data(),
                 cached_.size() * sizeof(Row));
    }
    return cached_[static_cast<std::size_t>(number - first_cached_)];
  }

 private:
  static constexpr std::size_t kPage = 512;  // rows that are written at once
  static constexpr int kCached = 64;         // rows that are read at once

  TemporaryFile file_;
  int spilled_ = 0;
  std::vector<Row> rows_;  // from number spilled_ on
  mutable int first_cached_ = 0;
  mutable std::vector<Row> cached_;
};

}  // namespace sqslam
