// Saves and restores the live map, to continue it in another run.
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <vector>

#include "slam/mapping/mapper.h"
#include "slam/snapshot/byte_archive.h"
#include "slam/util/raise_keys.h"
#include "slam/util/to_vector.h"

namespace sqslam {

std::string Mapper::Save() const {
  ByteWriter writer;
  const auto main = std::ranges::max_element(
      submaps_, {}, [](const auto& submap) { return submap.second.Frames().size(); });
  writer(submaps_.size(), main->first, last_loop_, loop_edges_, atlas_.origins);
  for (const auto& [number, submap] : submaps_) {
    submap.Save(writer);
  }
  return writer.Take();
}

struct Mapper::State {
  std::int64_t active = 0;
  KeyframeId last_loop = kNoKeyframe;
  LoopEdges loop_edges;
  std::map<std::int64_t, AtlasView::Origin> origins;
  std::vector<Submap> submaps;

  void Check(const ByteReader& reader) const;
  void Renumber(const IdShift& shift);
};

void Mapper::State::Check(const ByteReader& reader) const {
  std::set<std::int64_t> numbers;
  for (const Submap& submap : submaps) {
    if (submap.Number() < 0 || !origins.contains(submap.Number()) ||
        !numbers.insert(submap.Number()).second) {
      reader.Refuse(fmt::format("lists submap {} twice or without its origin", submap.Number()));
    }
  }
  for (const auto& [number, origin] : origins) {
    if (!numbers.contains(origin.submap) || !(origin.S_map_origin.scale > 0.0)) {
      reader.Refuse(fmt::format("lacks the submap that submap {} was merged into, or its scale", number));
    }
  }
  const auto known = [this](KeyframeId id) {
    return std::ranges::any_of(submaps, [id](const Submap& submap) { return submap.Map().HasKeyframe(id); });
  };
  if (!reader.AtEnd() || !numbers.contains(active) || !std::ranges::all_of(loop_edges, [&](const auto& edge) {
        return known(edge.first) && known(edge.second);
      })) {
    reader.Refuse("lacks its main submap or a keyframe of a loop, or continues after its end");
  }
}

void Mapper::State::Renumber(const IdShift& shift) {
  active += shift.submap;
  last_loop += last_loop == kNoKeyframe ? 0 : shift.keyframe;
  LoopEdges raised_edges;
  for (const auto& [a, b] : loop_edges) {
    raised_edges.insert({a + shift.keyframe, b + shift.keyframe});
  }
  loop_edges = std::move(raised_edges);
  ShiftKeys(origins, shift.submap);
  for (auto& [number, origin] : origins) {
    origin.submap += shift.submap;
  }
  for (Submap& submap : submaps) {
    submap.Renumber(shift);
  }
}

// Returns the least shift that makes the state's ids and times unique in this mapper.
IdShift Mapper::ShiftFor(const State& state, const IdSource& ids) const {
  IdShift shift{ids.next_keyframe, ids.next_point, 0, atlas_.origins.rbegin()->first + 1, 0, 0.0};
  for (const auto& [number, submap] : submaps_) {
    shift.object = std::max(shift.object, submap.Objects().View()->IdBound());
  }
  constexpr double kMinGap = 1.0;  // s, between the frames of the two maps
  const auto [end_frame, end_time] = *NewestFrame();
  for (const Submap& submap : state.submaps) {
    const auto& [index, oldest] = *submap.Frames().begin();
    shift.frame = std::max(shift.frame, end_frame + 1 - index);
    shift.time =
        std::max(shift.time, oldest.timestamp > end_time ? 0.0 : end_time + kMinGap - oldest.timestamp);
  }
  return shift;
}

Mapper::Restored Mapper::Restore(std::string_view bytes, const std::string& what,
                                 const std::shared_ptr<IdSource>& ids) {
  keeps_images_ = false;  // an existing map is extended, never made afresh
  ByteReader reader(bytes, what);
  State state;
  std::size_t count = 0;
  reader(count, state.active, state.last_loop, state.loop_edges, state.origins);
  for (; count > 0; --count) {
    state.submaps.emplace_back(reader, std::make_unique<Map>(pose_tracker_.Levels(), ids), camera_, options_);
  }
  state.Check(reader);
  Restored result;
  if (!submaps_.empty()) {
    const IdShift shift = ShiftFor(state, *ids);
    state.Renumber(shift);
    result.index_shift = shift.frame;
    result.time_shift = shift.time;
  }
  result.submap = state.active;
  result.oldest_frame = std::ranges::min(
      ToVector(state.submaps, [](const Submap& submap) { return submap.Frames().begin()->first; }));
  last_loop_ = std::max(last_loop_, state.last_loop);
  loop_edges_.merge(state.loop_edges);
  atlas_.origins.merge(state.origins);
  for (Submap& restored : state.submaps) {
    const std::int64_t number = restored.Number();
    Submap& submap = submaps_.emplace(number, std::move(restored)).first->second;
    Map& map = submap.Map();
    ids->next_keyframe = std::max(ids->next_keyframe.load(), map.IdBound());
    ids->next_point = std::max(ids->next_point.load(), map.Points().IdBound());
    for (const auto& [id, keyframe] : map.Keyframes()) {
      places_.Add(map.At(id));
    }
    atlas_.submaps[number] = submap.MakeView();
  }
  active_ = &submaps_.at(state.active);
  shown_.frame_index = active_->Frames().rbegin()->first;
  PublishView();
  return result;
}

}  // namespace sqslam
