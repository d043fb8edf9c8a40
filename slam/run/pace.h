#pragma once

#include <functional>
#include <optional>

namespace sqslam {

// The time as Pace sees it; a test brings its own.
struct PaceClock {
  std::function<double()> now;           // seconds from any start
  std::function<void(double)> sleep;     // seconds
  std::function<bool()> stop = nullptr;  // ends a wait early (Ctrl-C); may be empty
};
PaceClock SteadyPaceClock(std::function<bool()> stop);

// Plays a recording as a live camera would give it: a frame is there from its time on, and whoever comes late
// gets the newest one; those before it are dropped. The first frame's time is when it is first asked for.
class Pace {
 public:
  explicit Pace(PaceClock clock);

  // Waits for the frame's time (timestamps in seconds). False where the frame after it is there already: this
  // one is dropped. The last frame (no next) is never dropped.
  bool Admit(double timestamp, std::optional<double> next_timestamp);
  int Dropped() const { return dropped_; }

 private:
  PaceClock clock_;
  std::optional<double> offset_;  // clock minus timestamps
  int dropped_ = 0;
};

}  // namespace sqslam
