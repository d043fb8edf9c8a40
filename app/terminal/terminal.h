#pragma once

#include <chrono>
#include <cstdint>
#include <string>

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

// One line on stderr that says how far a program is: rewritten in place on a terminal, a new line every few
// seconds in a log file, nothing where quiet. A total of 0 is endless (a live camera).
class Progress {
 public:
  // `unit` is what is counted, in the singular.
  Progress(std::int64_t total, bool quiet, std::string unit = "frame");

  void Update(std::int64_t done, const std::string& state);
  void Finish();  // leaves the terminal's cursor on a line of its own

 private:
  using Clock = std::chrono::steady_clock;

  void Print(const std::string& line);

  std::int64_t total_;
  bool quiet_;
  std::string unit_;
  bool terminal_;
  bool line_open_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_ = start_;
};

}  // namespace sqslam::app
