#include "slam/mapping/frame_records.h"

#include <algorithm>
#include <limits>
#include <ranges>

#include "slam/snapshot/byte_archive.h"
#include "slam/util/raise_keys.h"

namespace sqslam {

FrameRecords::Row FrameRecords::Packed(std::int64_t index, const FrameRecord& frame) {
  Row row;
  row.index = index;
  row.reference = frame.pose.reference;
  row.timestamp = frame.timestamp;
  row.scale = frame.pose.scale;
  std::ranges::copy(frame.pose.T_camera_reference.rotation.coeffs(), row.rotation);
  std::ranges::copy(frame.pose.T_camera_reference.translation, row.translation);
  return row;
}

FrameRecord FrameRecords::Unpacked(const Row& row) {
  const Rigid3d T_camera_reference{Eigen::Quaterniond(row.rotation), Eigen::Vector3d(row.translation)};
  return {row.timestamp, {row.reference, T_camera_reference, row.scale}};
}

void FrameRecords::Record(std::int64_t index, OpenFrame frame) {
  if (!open_.contains(index) && Contains(index)) {  // hardly ever
    std::vector<Row> rows = Settled();
    std::erase_if(rows, [index](const Row& row) { return row.index == index; });
    Settle(rows);
  }
  open_[index] = std::move(frame);
}

// Settled frames stay in order: an earlier one that was recorded late stays open until the end of the run.
void FrameRecords::SettleBelow(std::int64_t index) {
  const std::int64_t newest = settled_.Size() > 0 ? settled_[settled_.Size() - 1].index : -1;
  const auto first = open_.upper_bound(newest);
  const auto end = open_.lower_bound(index);
  for (auto it = first; it != end && it != open_.end(); ++it) {
    settled_.Add(Packed(it->first, it->second));
  }
  if (newest < index) {
    open_.erase(first, end);
  }
}

int FrameRecords::FirstSettled(std::int64_t index) const {
  const auto numbers = std::views::iota(0, settled_.Size());
  return static_cast<int>(
      std::ranges::lower_bound(numbers, index, {}, [this](int i) { return settled_[i].index; }) -
      numbers.begin());
}

std::optional<FrameRecord> FrameRecords::Find(std::int64_t index) const {
  if (const auto it = open_.find(index); it != open_.end()) {
    return it->second;
  }
  const int number = FirstSettled(index);
  if (number < settled_.Size()) {
    if (const Row row = settled_[number]; row.index == index) {
      return Unpacked(row);
    }
  }
  return std::nullopt;
}

std::pair<std::int64_t, FrameRecord> FrameRecords::FromOn(std::int64_t index) const {
  const auto open = open_.lower_bound(index);
  const int number = FirstSettled(index);
  if (number < settled_.Size()) {
    const Row row = settled_[number];
    if (open == open_.end() || row.index < open->first) {
      return {row.index, Unpacked(row)};
    }
  }
  return open != open_.end() ? std::pair<std::int64_t, FrameRecord>(*open) : Newest();
}

std::pair<std::int64_t, FrameRecord> FrameRecords::Oldest() const {
  return FromOn(std::numeric_limits<std::int64_t>::min());
}

std::pair<std::int64_t, FrameRecord> FrameRecords::Newest() const {
  if (settled_.Size() > 0) {
    const Row row = settled_[settled_.Size() - 1];
    if (open_.empty() || open_.rbegin()->first < row.index) {
      return {row.index, Unpacked(row)};
    }
  }
  return *open_.rbegin();
}

void FrameRecords::ForEach(const std::function<void(std::int64_t index, const FrameRecord&)>& visit) const {
  auto open = open_.begin();
  for (int i = 0; i < settled_.Size(); ++i) {
    const Row row = settled_[i];
    for (; open != open_.end() && open->first < row.index; ++open) {
      visit(open->first, open->second);
    }
    visit(row.index, Unpacked(row));
  }
  for (; open != open_.end(); ++open) {
    visit(open->first, open->second);
  }
}

void FrameRecords::Absorb(FrameRecords&& other) {
  std::vector<Row> rows = Settled();
  for (const Row& row : other.Settled()) {
    if (!Contains(row.index)) {
      rows.push_back(row);
    }
  }
  for (auto& [index, frame] : other.open_) {
    if (!Contains(index)) {
      open_.emplace(index, std::move(frame));
    }
  }
  std::ranges::sort(rows, {}, &Row::index);
  Settle(rows);
}

void FrameRecords::Renumber(std::int64_t index_shift, double time_shift, KeyframeId keyframe_shift) {
  std::vector<Row> rows = Settled();
  for (Row& row : rows) {
    row.index += index_shift;
    row.timestamp += time_shift;
    row.reference += keyframe_shift;
  }
  Settle(rows);
  RaiseKeys(open_, index_shift);
  for (auto& [index, frame] : open_) {
    frame.timestamp += time_shift;
    frame.pose.reference += keyframe_shift;
  }
}

std::vector<FrameRecords::Row> FrameRecords::Settled() const {
  std::vector<Row> rows;
  for (int i = 0; i < settled_.Size(); ++i) {
    rows.push_back(settled_[i]);
  }
  return rows;
}

void FrameRecords::Settle(const std::vector<Row>& rows) {
  settled_ = {};
  for (const Row& row : rows) {
    settled_.Add(row);
  }
}

void FrameRecords::Save(ByteWriter& writer) const {
  writer(static_cast<std::uint32_t>(Size()));
  ForEach([&writer](std::int64_t index, const FrameRecord& frame) { writer(index, frame); });
}

void FrameRecords::Load(ByteReader& reader) {
  std::map<std::int64_t, FrameRecord> frames;
  reader(frames);
  open_.clear();
  settled_ = {};
  for (const auto& [index, frame] : frames) {
    settled_.Add(Packed(index, frame));
  }
}

}  // namespace sqslam
