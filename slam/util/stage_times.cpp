#include "slam/util/stage_times.h"

#include <algorithm>

#include "slam/util/statistics.h"

namespace sqslam {

void StageTimes::Samples::Add(double milliseconds) {
  constexpr std::size_t kMaxSamples = 16384;  // per stage: nine minutes of one that runs each frame
  sum += milliseconds;
  max = std::max(max, milliseconds);
  if (count++ % every != 0) {
    return;
  }
  kept.push_back(milliseconds);
  if (kept.size() == kMaxSamples) {
    for (std::size_t i = 0; 2 * i < kept.size(); ++i) {
      kept[i] = kept[2 * i];
    }
    kept.resize(kept.size() / 2);
    every *= 2;
  }
}

StageTimes::Summary StageTimes::Samples::Summarize() const {
  return {sum / count, NearestQuantile(kept, 0.5), NearestQuantile(kept, 0.95), max, count};
}

void StageTimes::Add(std::string_view stage, double milliseconds) {
  const std::lock_guard lock(mutex_);
  stages_.try_emplace(std::string(stage)).first->second.Add(milliseconds);
}

std::map<std::string, StageTimes::Summary> StageTimes::Summaries() const {
  const std::lock_guard lock(mutex_);
  std::map<std::string, Summary> summaries;
  for (const auto& [stage, samples] : stages_) {
    summaries[stage] = samples.Summarize();
  }
  return summaries;
}

}  // namespace sqslam
