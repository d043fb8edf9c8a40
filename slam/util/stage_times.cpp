#include "slam/util/stage_times.h"

#include <algorithm>
#include <numeric>

#include "slam/util/statistics.h"

namespace sqslam {

void StageTimes::Add(std::string_view stage, double milliseconds) {
  const std::lock_guard lock(mutex_);
  stages_[std::string(stage)].push_back(milliseconds);
}

std::map<std::string, StageTimes::Summary> StageTimes::Summaries() const {
  const std::lock_guard lock(mutex_);
  std::map<std::string, Summary> summaries;
  for (const auto& [stage, durations] : stages_) {
    const auto count = static_cast<int>(durations.size());
    summaries[stage] = {std::accumulate(durations.begin(), durations.end(), 0.0) / count,
                        NearestQuantile(durations, 0.5), NearestQuantile(durations, 0.95),
                        std::ranges::max(durations), count};
  }
  return summaries;
}

}  // namespace sqslam
