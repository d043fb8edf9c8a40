#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <vector>

#include "app/viewer/model/run_history.h"
#include "slam/snapshot/snapshot.h"
#include "slam/tracking/frame_view.h"

namespace sqslam::viewer {

// All that the window shows of one frame of a run. A value: made by the thread that reads or maps, never
// changed afterwards.
struct ShownFrame {
  std::int64_t frame_index = 0;
  double timestamp = 0.0;                     // seconds
  MapSnapshotPtr map;                         // the newest at this frame, its camera that of the frame
  cv::Mat image;                              // 8UC3 as recorded; empty where there is none
  std::string no_image;                       // why, where it is empty
  std::vector<SnapshotDetection> detections;  // boxes of the frame, pixels of the image
  std::vector<FrameView::Feature> features;   // of a run that goes on; empty for recordings, which keep none
};

using ShownFramePtr = std::shared_ptr<const ShownFrame>;

// A frame of the run that can be shown, with the state of the map that was the newest then.
struct Moment {
  std::int64_t frame_index = 0;
  double timestamp = 0.0;  // seconds
  int snapshot = 0;        // of the recording
  bool tracked = true;     // its pose in the map is known, as far as anybody can tell
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
  const Moment& MomentAt(double time) const { return moments.at(static_cast<std::size_t>(At(time))); }

  // Spans of time (seconds) without poses in the map: tracking was lost, or what was mapped then never found
  // its place in it.
  std::vector<std::pair<double, double>> Gaps() const;

  // The moment that shows the state of the map at a snapshot for the first time; -1 where there is none.
  int OfSnapshot(int snapshot) const;
};

// The place on a timeline that is shown, and whether it moves on by itself.
struct Playback {
  bool playing = false;
  double speed = 1.0;  // run seconds a second; below 0 backward
  double time = 0.0;   // seconds, on the timeline

  void JumpTo(double to) {  // and stops
    playing = false;
    time = to;
  }

  // Moves on by `seconds` of the wall clock; stops at the ends.
  void Advance(double seconds, const Timeline& timeline);

  // Plays in a direction (1 or -1), or stops what plays that way; at the end (or, backward, at the start) it
  // begins again.
  void Toggle(double direction, const Timeline& timeline);
  bool Plays(double direction) const { return playing && speed * direction > 0.0; }

  // To the next (1) or previous (-1) moment; stops.
  void Step(int count, const Timeline& timeline);
  // The same by snapshots: to the next state of the map.
  void StepSnapshot(int count, const Timeline& timeline);
};

// A run that goes on behind the window.
struct RunStatus {
  bool active = false;
  bool paused = false;
  bool ending = false;      // no more frames; what is mapped is being finished and saved
  std::string state;        // "tracking", "waiting for motion", ...
  std::int64_t frames = 0;  // done
  std::int64_t total = 0;   // 0: endless
  double max_rate = 0.0;    // frames a second at most; 0: as fast as it goes
};

// A request to it.
struct RunControl {
  enum class What { kPause, kContinue, kStep, kEnd, kRate };  // step: one frame, then pause; end: and save
  What what = What::kPause;
  double max_rate = 0.0;  // of kRate
};

}  // namespace sqslam::viewer
