#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <thread>
#include <utility>

namespace sqslam {

// Clock of Pace; replaced in tests.
struct PaceClock {
  std::function<double()> now;           // seconds from any start
  std::function<void(double)> sleep;     // seconds
  std::function<bool()> stop = nullptr;  // ends a wait early (Ctrl-C); may be empty
};
inline PaceClock SteadyPaceClock(std::function<bool()> stop) {
  using Seconds = std::chrono::duration<double>;
  return {[] { return Seconds(std::chrono::steady_clock::now().time_since_epoch()).count(); },
          [](double seconds) { std::this_thread::sleep_for(Seconds(seconds)); }, std::move(stop)};
}

// Plays a recording like a live camera: a frame is available from its time on, and a late reader gets the
// newest one; older ones are dropped. A reader slower than the frames gets one every half second. The first
// frame's time is when it is first requested.
class Pace {
 public:
  explicit Pace(PaceClock clock) : clock_(std::move(clock)) {}

  // Waits for the frame's time (timestamps in seconds). Returns false if the next frame is due already: this
  // one is dropped. The last frame (no next) is never dropped.
  bool Admit(double timestamp, std::optional<double> next_timestamp) {
    constexpr double kMaxSleep = 0.1;  // seconds; a gap in the recording must not delay Ctrl-C
    if (!offset_) {
      offset_ = clock_.now() - timestamp;
    }
    const double now = clock_.now();
    if (next_timestamp && now >= *next_timestamp + *offset_) {
      dropping_since_ = dropping_since_.value_or(now);
      if (now - *dropping_since_ < kMaxDropping) {
        ++dropped_;
        return false;
      }
    }
    dropping_since_.reset();
    for (double early = timestamp + *offset_ - clock_.now(); early > 0.0 && !(clock_.stop && clock_.stop());
         early = timestamp + *offset_ - clock_.now()) {
      clock_.sleep(std::min(early, kMaxSleep));
    }
    return true;
  }
  int Dropped() const { return dropped_; }

 private:
  static constexpr double kMaxDropping = 0.5;  // seconds

  PaceClock clock_;
  std::optional<double> offset_;          // clock minus timestamps
  std::optional<double> dropping_since_;  // the first frame after the last that was not dropped
  int dropped_ = 0;
};

}  // namespace sqslam
