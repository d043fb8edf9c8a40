#include "slam/run/pace.h"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

namespace sqslam {
namespace {

constexpr double kMaxSleep = 0.1;  // seconds; a gap in the recording must not keep Ctrl-C waiting

}  // namespace

PaceClock SteadyPaceClock(std::function<bool()> stop) {
  using Seconds = std::chrono::duration<double>;
  return {[] { return Seconds(std::chrono::steady_clock::now().time_since_epoch()).count(); },
          [](double seconds) { std::this_thread::sleep_for(Seconds(seconds)); }, std::move(stop)};
}

Pace::Pace(PaceClock clock) : clock_(std::move(clock)) {}

bool Pace::Admit(double timestamp, std::optional<double> next_timestamp) {
  if (!offset_) {
    offset_ = clock_.now() - timestamp;
  }
  if (next_timestamp && clock_.now() >= *next_timestamp + *offset_) {
    ++dropped_;
    return false;
  }
  for (double early = timestamp + *offset_ - clock_.now(); early > 0.0 && !(clock_.stop && clock_.stop());
       early = timestamp + *offset_ - clock_.now()) {
    clock_.sleep(std::min(early, kMaxSleep));
  }
  return true;
}

}  // namespace sqslam
