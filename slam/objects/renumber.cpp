#include "slam/objects/renumber.h"

#include <map>
#include <utility>

namespace sqslam {

void Renumber(int id_shift, std::int64_t point_shift, std::int64_t frame_shift, Landmark& landmark) {
  landmark.id += id_shift;
  for (BoxView& view : landmark.views) {
    view.frame_index += frame_shift;
  }
  for (auto& [frame, view] : landmark.lines) {
    frame += frame_shift;
  }
  std::map<std::int64_t, Landmark::PointVotes> votes;
  for (const auto& [point, vote] : landmark.votes) {
    votes.emplace_hint(votes.end(), point + point_shift, vote);
  }
  landmark.votes = std::move(votes);
  for (auto& [point, p_map] : landmark.points) {
    point += point_shift;
  }
  for (PointVerdict& verdict : landmark.verdicts) {
    verdict.point += point_shift;
  }
}

}  // namespace sqslam
