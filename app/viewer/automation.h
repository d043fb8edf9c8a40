#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/viewer/input/input_events.h"
#include "app/viewer/state/viewer_state.h"
#include "app/viewer/viewer.h"
#include "slam/util/stage_times.h"

namespace sqslam::viewer {

// Plays a script of events, one step per frame.
class ScriptPlayer {
 public:
  // `picture` writes the window as last drawn to a file.
  ScriptPlayer(std::vector<ScriptLine> script, std::string source,
               std::function<void(const std::string& file)> picture);

  // Returns the events before the next frame; empty while waiting. Throws InputError with source and line if
  // an expectation fails, a file cannot be written, or a wait takes longer than a minute.
  std::vector<InputEvent> Next(const Viewer& viewer, double seconds);
  bool Done() const { return at_ >= script_.size() && frames_left_ <= 0; }

 private:
  void Act(const ScriptLine& line, const Viewer& viewer) const;
  static bool Waits(const ScriptLine& line, const Viewer& viewer);
  static void Expect(const ScriptLine& line, const Viewer& viewer);

  std::vector<ScriptLine> script_;
  std::string source_;
  std::function<void(const std::string&)> picture_;
  std::size_t at_ = 0;
  int frames_left_ = 0;
  double waited_ = 0.0;  // seconds
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// Returns the value of a key of `expect`: title, selected, hovered, answers, hint, frame, objects, playing,
// style, preset, error, ... Throws InputError for an unknown key.
std::string StateValue(const ViewerState& state, const std::string& key);

// Measures the speed of the window, for --timing.
class FrameTiming {
 public:
  // Must be called after each frame of the window. `seconds`: time to draw it, empty if nothing was drawn.
  void Add(const ViewerState& state, std::optional<double> seconds);

  std::string Text() const;

 private:
  using Clock = std::chrono::steady_clock;

  StageTimes times_;  // of drawing, and from a change of the time to its frame on screen
  std::optional<Clock::time_point>
      outdated_;  // since when the frame on screen is not the one at the present time
};

}  // namespace sqslam::viewer
