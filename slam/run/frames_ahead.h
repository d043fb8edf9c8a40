#pragma once

#include <deque>
#include <optional>
#include <utility>

#include "slam/io/frame_source.h"
#include "slam/system.h"

namespace sqslam {

inline constexpr int kFramesAhead = 8;  // 1.2 MB each at 640x480

// Reads the frames of a recording ahead, so that a system extracts their features while it tracks and maps
// the frames before.
//
//   FramesAhead frames(source, system);
//   while (std::optional<Frame> frame = frames.Next()) {
//     system.Process(*frame);
//   }
class FramesAhead {
 public:
  // `boxes`: false drops the boxes of the frames. `count`: frames read ahead; 0 for a live camera, and for
  // frames whose boxes a detector delivers later: they decide where features are taken.
  FramesAhead(FrameStream& source, System& system, bool boxes = true, int count = kFramesAhead)
      : source_(source), system_(system), boxes_(boxes), count_(count) {}

  std::optional<Frame> Next() {
    while (!ended_ && std::ssize(frames_) <= count_) {
      std::optional<Frame> frame = source_.Next();
      ended_ = !frame;
      if (!frame) {
        break;
      }
      if (!boxes_) {
        frame->detections.clear();
      }
      if (count_ > 0) {
        system_.Expect(*frame);
      }
      frames_.push_back(*std::move(frame));
    }
    if (frames_.empty()) {
      return std::nullopt;
    }
    Frame frame = std::move(frames_.front());
    frames_.pop_front();
    return frame;
  }

 private:
  FrameStream& source_;
  System& system_;
  bool boxes_;
  int count_;
  std::deque<Frame> frames_;
  bool ended_ = false;
};

}  // namespace sqslam
