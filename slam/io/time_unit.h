#pragma once

#include <array>
#include <string>
#include <vector>

namespace sqslam {

struct TimeUnit {
  double seconds = 1.0;
  const char* name = "seconds";
};

// Seconds, milliseconds, microseconds and nanoseconds, in this order.
inline constexpr std::array<TimeUnit, 4> kTimeUnits = {
    {{1.0, "seconds"}, {1e-3, "milliseconds"}, {1e-6, "microseconds"}, {1e-9, "nanoseconds"}}};

// Recognises the unit of rising times of a film or of its poses: by their size if they are Unix time, else by
// their median step, which is under 4 s, or under 15 s if they are not all `written_whole`, without a decimal
// point. Times written whole with such a step, and no Unix time, are frame numbers, whose unit is a frame at
// `fps`. Fewer than two times count as seconds.
TimeUnit UnitOfTimes(const std::vector<double>& times, bool written_whole, double fps);

// Logs that a file's times are in another unit than seconds.
void ReportTimeUnit(const std::string& file, const TimeUnit& unit);

}  // namespace sqslam
