#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "app/viewer/state/viewer_state.h"

namespace sqslam::viewer {

// Measures how fast the window is, for --timing.
class FrameTiming {
 public:
  // After each frame of the window; `seconds`: what drawing it took, empty where nothing was drawn.
  void Add(const ViewerState& state, std::optional<double> seconds);

  // A few lines.
  std::string Text() const;

 private:
  using Clock = std::chrono::steady_clock;

  Clock::time_point start_ = Clock::now();
  std::optional<double> opened_;             // seconds until the first map was on the screen
  std::vector<double> drawing_;              // seconds of each frame
  std::vector<double> latencies_;            // seconds from another place in time to its frame on the screen
  std::optional<Clock::time_point> wanted_;  // since when the screen shows another frame than it should
  std::optional<Clock::time_point> run_start_;
  double run_seconds_ = 0.0;
  int run_frames_ = 0;  // of the window, while a run went on
};

}  // namespace sqslam::viewer
