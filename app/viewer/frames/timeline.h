#pragma once

#include <cstdint>
#include <vector>

#include "app/viewer/model/run_series.h"

namespace sqslam::viewer {

// A frame of the run that can be shown, with the state of the map that was the newest then.
struct Moment {
  std::int64_t frame_index = 0;
  double timestamp = 0.0;  // seconds
  int snapshot = 0;        // of the recording
};

// The time axis of a run: its frames in order, and marks on it.
struct Timeline {
  std::vector<Moment> moments;  // by rising time
  RunSeries series;             // of its snapshots; may end early while a recording is being read

  bool Empty() const { return moments.empty(); }
  int Last() const { return static_cast<int>(moments.size()) - 1; }
  double Begin() const { return Empty() ? 0.0 : moments.front().timestamp; }
  double End() const { return Empty() ? 0.0 : moments.back().timestamp; }

  // The newest moment that is not after `time` (seconds); the first one before that. -1 where there is none.
  int At(double time) const;

  // The moment that shows the state of the map at a snapshot for the first time; -1 where there is none.
  int OfSnapshot(int snapshot) const;
};

// Where playing stands on a timeline.
struct Playback {
  bool playing = false;
  double speed = 1.0;  // run seconds a second; below 0 backward
  double time = 0.0;   // seconds, on the timeline

  // Moves on by `seconds` of the wall clock; stops at the ends.
  void Advance(double seconds, const Timeline& timeline);

  // Plays or stops; at the end (or, backward, at the start) it begins again.
  void Toggle(const Timeline& timeline);

  // To the next (1) or previous (-1) moment; stops.
  void Step(int count, const Timeline& timeline);
  // The same by snapshots: to the next state of the map.
  void StepSnapshot(int count, const Timeline& timeline);
};

}  // namespace sqslam::viewer
