#pragma once

namespace sqslam::app {

// While one lives, the first Ctrl-C (SIGINT) or SIGTERM only sets a flag; the second ends the program as
// usual.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  bool Interrupted() const;
};

}  // namespace sqslam::app
