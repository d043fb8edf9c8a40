#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <ranges>
#include <utility>
#include <vector>

#include "slam/util/to_vector.h"

namespace sqslam {

// Keeps about `most` frames by their `index`, thinned out evenly.
template <typename Frame>
class ThinnedFrames {
 public:
  explicit ThinnedFrames(int most) : most_(most) {}

  void Add(Frame frame) {
    if (offered_++ % every_ != 0 || most_ == 0) {
      return;
    }
    if (static_cast<int>(frames_.size()) >= most_) {
      every_ *= 2;
      bool odd = false;
      std::erase_if(frames_, [&](const auto&) { return std::exchange(odd, !odd); });
    }
    const std::int64_t index = frame.index;
    frames_.insert_or_assign(index, std::move(frame));
  }
  void Remove(std::int64_t index) { frames_.erase(index); }

  const std::map<std::int64_t, Frame>& ByIndex() const { return frames_; }
  std::vector<std::int64_t> Indices() const { return ToVector(frames_ | std::views::keys); }

 private:
  int most_;
  std::int64_t every_ = 1;    // one frame in this many is kept
  std::int64_t offered_ = 0;  // number of Add() calls
  std::map<std::int64_t, Frame> frames_;
};

}  // namespace sqslam
