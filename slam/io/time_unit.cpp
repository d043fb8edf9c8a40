#include "slam/io/time_unit.h"

#include <spdlog/spdlog.h>

#include <cstddef>
#include <utility>

#include "slam/util/statistics.h"

namespace sqslam {

TimeUnit UnitOfTimes(const std::vector<double>& times, bool written_whole, double fps) {
  if (times.size() < 2) {
    return kTimeUnits.front();
  }
  constexpr double kMinUnixTime = 8e8;  // seconds, 1995
  constexpr double kMaxUnixTime = 8e9;
  for (const TimeUnit& unit : kTimeUnits) {
    if (const double first = unit.seconds * times.front(); first > kMinUnixTime && first < kMaxUnixTime) {
      return unit;
    }
  }
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) {
    steps.push_back(times[i] - times[i - 1]);
  }
  const double step = UpperMedian(std::move(steps));
  // Four milliseconds are 250 images a second. With a decimal point, as much may be seconds between few
  // images.
  const double max_seconds = written_whole ? 4.0 : 15.0;
  constexpr double kMaxMilliStep = 4e3;  // four seconds, or microseconds at 250 images a second
  constexpr double kMaxMicroStep = 4e6;
  if (step >= max_seconds) {
    return kTimeUnits[step < kMaxMilliStep ? 1 : step < kMaxMicroStep ? 2 : 3];
  }
  return written_whole && fps > 0.0 ? TimeUnit{1.0 / fps, "frame numbers"} : kTimeUnits.front();
}

void ReportTimeUnit(const std::string& file, const TimeUnit& unit) {
  if (unit.seconds != 1.0) {
    spdlog::info("{}: its times are {}, taken as such", file, unit.name);
  }
}

}  // namespace sqslam
