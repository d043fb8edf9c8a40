#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <vector>

#include "app/viewer/model/run_history.h"
#include "slam/snapshot/snapshot.h"
#include "slam/tracking/tracking_report.h"

namespace sqslam::viewer {

// All that the window shows of one frame. Immutable once made by the thread that reads or maps.
struct ShownFrame {
  std::int64_t frame_index = 0;
  double timestamp = 0.0;                     // seconds
  MapSnapshotPtr map;                         // the newest at this frame, with the camera pose of the frame
  cv::Mat image;                              // 8UC3 as recorded; empty if there is none
  std::string no_image;                       // the reason if it is empty
  std::vector<SnapshotDetection> detections;  // boxes of the frame, pixels of the image
  std::vector<FrameView::Feature> features;   // only during a run: recordings keep none
};

using ShownFramePtr = std::shared_ptr<const ShownFrame>;

// A frame of the run that can be shown, with the newest map state at that time.
struct Moment {
  std::int64_t frame_index = 0;
  double timestamp = 0.0;  // seconds
  int snapshot = 0;        // index in the recording
  bool tracked = true;     // false if its pose in the map is known to be missing
};

// The time axis of a run: its frames in order, and marks on it.
struct Timeline {
  std::vector<Moment> moments;  // ascending in time
  RunSeries series;             // of its snapshots; incomplete while a recording is being read

  bool Empty() const { return moments.empty(); }
  int Last() const { return static_cast<int>(moments.size()) - 1; }
  double Begin() const { return Empty() ? 0.0 : moments.front().timestamp; }
  double End() const { return Empty() ? 0.0 : moments.back().timestamp; }

  // Returns the last moment at or before `time` (seconds), else the first one; -1 if there is none.
  int At(double time) const;
  const Moment& MomentAt(double time) const { return moments.at(static_cast<std::size_t>(At(time))); }

  // Returns the intervals (seconds) without poses in the map: tracking was lost, or a submap never merged.
  std::vector<std::pair<double, double>> Gaps() const;

  // Returns the first moment that shows this or a later snapshot; the last one if there is none, -1 if empty.
  int OfSnapshot(int snapshot) const;
};

// The position on a timeline, and whether and how fast it moves.
struct Playback {
  bool playing = false;
  double speed = 1.0;  // run seconds a second; below 0 backward
  double time = 0.0;   // seconds, on the timeline

  void JumpTo(double to) {  // also stops
    playing = false;
    time = to;
  }

  // Advances by `seconds` of wall-clock time; stops at the ends.
  void Advance(double seconds, const Timeline& timeline);

  // Plays in a direction (1 or -1), from the start if at its end; stops if it plays that way already.
  void Toggle(double direction, const Timeline& timeline);
  bool Plays(double direction) const { return playing && speed * direction > 0.0; }

  // Steps by `count` moments (1: next, -1: previous) and stops.
  void Step(int count, const Timeline& timeline);
  // Likewise by snapshots, that is states of the map.
  void StepSnapshot(int count, const Timeline& timeline);
};

// The state of a run.
struct RunStatus {
  bool active = false;
  bool paused = false;
  bool ending = false;      // no more frames; the map is being finished and saved
  std::string state;        // "tracking", "waiting for motion", ...
  std::int64_t frames = 0;  // done
  std::int64_t total = 0;   // 0: endless
  double max_rate = 0.0;    // frames a second at most; 0: unlimited
};

// A request to the run.
struct RunControl {
  enum class Command { kPause, kContinue, kStep, kEnd, kRate };  // step: one frame, then pause; end: and save
  Command command = Command::kPause;
  double max_rate = 0.0;  // for kRate
};

}  // namespace sqslam::viewer
