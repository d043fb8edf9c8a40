#include "slam/objects/estimation_order.h"

#include <algorithm>
#include <utility>

namespace sqslam {
namespace {

std::vector<int> IdsInOrder(std::vector<std::pair<double, int>> keyed) {
  std::sort(keyed.begin(), keyed.end());
  std::vector<int> ids;
  for (const auto& [key, id] : keyed) {
    ids.push_back(id);
  }
  return ids;
}

}  // namespace

std::vector<int> MostOutdated(const std::map<int, Landmark>& landmarks, int most) {
  constexpr double kOutdated = 1.0 / 6.0;
  std::vector<std::pair<double, int>> never;  // the more boxes the sooner
  std::vector<std::pair<double, int>> outdated;
  for (const auto& [id, landmark] : landmarks) {
    const double since = landmark.observations - landmark.estimated_at;
    if (landmark.estimated_at == 0) {
      never.emplace_back(-since, id);
    } else if (since >= kOutdated * landmark.estimated_at) {
      outdated.emplace_back(-since / landmark.estimated_at, id);
    }
  }
  std::vector<int> ids = IdsInOrder(std::move(never));
  const std::vector<int> others = IdsInOrder(std::move(outdated));
  ids.insert(ids.end(), others.begin(), others.end());
  if (most > 0 && ids.size() > static_cast<std::size_t>(most)) {
    ids.resize(static_cast<std::size_t>(most));
  }
  return ids;
}

std::vector<int> LargestFirst(const std::map<int, Landmark>& landmarks, const std::vector<int>& ids) {
  std::vector<std::pair<double, int>> by_volume;
  for (const int id : ids) {
    const Landmark& landmark = landmarks.at(id);
    by_volume.emplace_back(landmark.estimated ? -landmark.superquadric.shape.Volume() : 0.0, id);
  }
  return IdsInOrder(std::move(by_volume));
}

}  // namespace sqslam
