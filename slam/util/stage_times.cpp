#include "slam/util/stage_times.h"

#include <algorithm>
#include <numeric>

namespace sqslam {

void StageTimes::Add(std::string_view stage, double milliseconds) {
  const std::lock_guard lock(mutex_);
  const auto it = samples_.find(stage);
  if (it != samples_.end()) {
    it->second.push_back(milliseconds);
  } else {
    samples_.emplace(std::string(stage), std::vector<double>{milliseconds});
  }
}

std::map<std::string, StageTimes::Summary> StageTimes::Summaries() const {
  const std::lock_guard lock(mutex_);
  std::map<std::string, Summary> summaries;
  for (const auto& [stage, samples] : samples_) {
    std::vector<double> sorted = samples;
    std::sort(sorted.begin(), sorted.end());
    const auto quantile = [&](double q) {
      return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1) + 0.5)];
    };
    const double sum = std::accumulate(sorted.begin(), sorted.end(), 0.0);
    summaries[stage] = {sum / static_cast<double>(sorted.size()), quantile(0.5), quantile(0.95),
                        sorted.back(), static_cast<int>(sorted.size())};
  }
  return summaries;
}

}  // namespace sqslam
