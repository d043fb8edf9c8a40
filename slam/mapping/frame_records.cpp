#include "slam/mapping/frame_records.h"

#include <limits>

#include "slam/snapshot/byte_archive.h"
#include "slam/util/raise_keys.h"

namespace sqslam {

void FrameRecords::Record(std::int64_t index, OpenFrame frame) {
  settled_.erase(index);
  open_[index] = std::move(frame);
}

// A frame that was recorded after a later one had been settled stays open until the end of the run.
void FrameRecords::SettleBelow(std::int64_t index) {
  const std::int64_t newest = settled_.empty() ? -1 : settled_.rbegin()->first;
  if (newest >= index) {
    return;
  }
  const auto first = open_.upper_bound(newest);
  const auto end = open_.lower_bound(index);
  settled_.insert(first, end);
  open_.erase(first, end);
}

std::optional<FrameRecord> FrameRecords::Find(std::int64_t index) const {
  if (const auto open = open_.find(index); open != open_.end()) {
    return open->second;
  }
  const auto settled = settled_.find(index);
  return settled != settled_.end() ? std::optional(settled->second) : std::nullopt;
}

std::pair<std::int64_t, FrameRecord> FrameRecords::FromOn(std::int64_t index) const {
  const auto open = open_.lower_bound(index);
  const auto settled = settled_.lower_bound(index);
  if (open == open_.end() && settled == settled_.end()) {
    return Newest();
  }
  if (open == open_.end() || (settled != settled_.end() && settled->first < open->first)) {
    return *settled;
  }
  return *open;
}

std::pair<std::int64_t, FrameRecord> FrameRecords::Oldest() const {
  return FromOn(std::numeric_limits<std::int64_t>::min());
}

std::pair<std::int64_t, FrameRecord> FrameRecords::Newest() const {
  if (!settled_.empty() && (open_.empty() || open_.rbegin()->first < settled_.rbegin()->first)) {
    return *settled_.rbegin();
  }
  return *open_.rbegin();
}

void FrameRecords::ForEach(const std::function<void(std::int64_t index, const FrameRecord&)>& visit) const {
  auto open = open_.begin();
  for (const auto& [index, frame] : settled_) {
    for (; open != open_.end() && open->first < index; ++open) {
      visit(open->first, open->second);
    }
    visit(index, frame);
  }
  for (; open != open_.end(); ++open) {
    visit(open->first, open->second);
  }
}

void FrameRecords::Absorb(FrameRecords&& other) {
  for (auto& [index, frame] : other.settled_) {
    if (!open_.contains(index)) {
      settled_.emplace(index, frame);
    }
  }
  for (auto& [index, frame] : other.open_) {
    if (!Contains(index)) {
      open_.emplace(index, std::move(frame));
    }
  }
}

void FrameRecords::Renumber(std::int64_t index_shift, double time_shift, KeyframeId keyframe_shift) {
  const auto shift = [&](auto& frames) {
    RaiseKeys(frames, index_shift);
    for (auto& [index, frame] : frames) {
      frame.timestamp += time_shift;
      frame.pose.reference += keyframe_shift;
    }
  };
  shift(settled_);
  shift(open_);
}

void FrameRecords::Save(ByteWriter& writer) const {
  writer(static_cast<std::uint32_t>(Size()));
  ForEach([&writer](std::int64_t index, const FrameRecord& frame) { writer(index, frame); });
}

void FrameRecords::Load(ByteReader& reader) {
  open_.clear();
  settled_.clear();
  reader(settled_);
}

}  // namespace sqslam
