// What Mapper keeps beyond a run: its state as bytes.
#include <fmt/format.h>

#include <algorithm>
#include <ranges>

#include "slam/mapping/mapper.h"
#include "slam/snapshot/byte_archive.h"

namespace sqslam {

std::string Mapper::Save() const {
  ByteWriter writer;
  writer(submaps_.size(), active_->Number(), last_loop_, loop_edges_, atlas_.origins);
  for (const auto& [number, submap] : submaps_) {
    submap.Save(writer);
  }
  return writer.Take();
}

std::int64_t Mapper::Restore(std::string_view state, const std::string& what,
                             const std::shared_ptr<IdSource>& ids) {
  ByteReader reader(state, what);
  std::size_t count = 0;
  std::int64_t active = 0;
  reader(count, active, last_loop_, loop_edges_, atlas_.origins);
  for (; count > 0; --count) {
    Submap submap(reader, std::make_unique<Map>(pose_tracker_.Levels(), ids), camera_, options_);
    const std::int64_t number = submap.Number();
    Map& map = submap.Map();
    ids->next_keyframe = std::max(ids->next_keyframe.load(), map.IdBound());
    ids->next_point = std::max(ids->next_point.load(), map.Points().IdBound());
    for (const auto& [id, keyframe] : map.Keyframes()) {
      places_.Add(map.At(id));
    }
    if (number < 0 || !atlas_.origins.contains(number) ||
        !submaps_.emplace(number, std::move(submap)).second) {
      reader.Refuse(fmt::format("has no place for its part {}", number));
    }
  }
  for (const auto& [number, origin] : atlas_.origins) {
    if (!submaps_.contains(origin.submap) || !(origin.S_map_origin.scale > 0.0)) {
      reader.Refuse(fmt::format("lacks the part that holds part {}", number));
    }
  }
  const auto known = [this](KeyframeId id) {
    return std::ranges::any_of(std::views::values(submaps_),
                               [id](const Submap& submap) { return submap.Map().HasKeyframe(id); });
  };
  if (!reader.AtEnd() || !submaps_.contains(active) ||
      !std::ranges::all_of(loop_edges_,
                           [&](const auto& edge) { return known(edge.first) && known(edge.second); })) {
    reader.Refuse("is broken");
  }
  for (auto& [number, submap] : submaps_) {
    atlas_.submaps[number] = submap.MakeView();
  }
  active_ = &submaps_.at(active);
  shown_.frame_index = active_->NewestFrame();
  PublishView();
  return active;
}

std::optional<std::pair<std::int64_t, double>> Mapper::NewestFrame() const {
  std::optional<std::pair<std::int64_t, double>> newest;
  for (const auto& [number, submap] : submaps_) {
    const auto& [index, timestamp] = submap.NewestFrameTime();
    newest = {std::max(newest ? newest->first : 0, index),
              std::max(newest ? newest->second : 0.0, timestamp)};
  }
  return newest;
}

}  // namespace sqslam
