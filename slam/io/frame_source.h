#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "slam/io/frame.h"
#include "slam/io/sequence.h"

namespace sqslam {

// Range of frames to play: start, start + stride, ..., at most `count` of them.
struct FrameRange {
  std::int64_t start = 0;
  std::int64_t count = std::numeric_limits<std::int64_t>::max();
  std::int64_t stride = 1;

  std::int64_t SizeIn(const Sequence& sequence) const;  // number of frames that will be played
  void CheckHasFrames(const Sequence& sequence) const;  // throws UsageError if there are none
};

// Returns frames of the range at about `rate` a second, at least `min_frames` if the range has as many; all
// of a sequence whose `fps` is unknown (0). `available`: frames in the range.
FrameRange ThinnedRange(const FrameRange& range, std::int64_t available, double fps, double rate,
                        std::int64_t min_frames);

// Returns the range for --frames, --start and --stride. `frames` is "N" for N frames from the start, or "A:B"
// for frame A up to but not including frame B, either of which may be omitted; empty: all. Throws UsageError.
FrameRange ParseFrameRange(const std::string& frames, std::optional<std::int64_t> start = std::nullopt,
                           std::int64_t stride = 1);

// A source of frames, one after the other.
class FrameStream {
 public:
  FrameStream() = default;
  virtual ~FrameStream() = default;
  FrameStream(const FrameStream&) = delete;
  FrameStream& operator=(const FrameStream&) = delete;

  virtual std::optional<Frame> Next() = 0;  // empty at the end
  virtual int Skipped() const = 0;          // frames that could not be used so far
  virtual int Dropped() const = 0;          // frames that came faster than they were consumed
};

// Decodes the frames of a sequence ahead on a thread of its own (joined by the destructor) and returns them
// in order. A photograph taken with the camera turned is turned back (QuarterTurnsTo). Images
// that are missing, unreadable or not of the camera's size are skipped, with one warning at the end for each
// kind of problem; a video that ends early causes one warning, and its missing frames count as skipped.
// Mute() leaves the warnings to another source of the same frames.
//
//   FrameSource source(sequence, {.start = 0, .count = 100});
//   while (std::optional<Frame> frame = source.Next()) { ... }
class FrameSource : public FrameStream {
 public:
  explicit FrameSource(const Sequence& sequence, const FrameRange& range = {}, int decoded_ahead = 6);
  ~FrameSource() override;

  std::optional<Frame> Next() override;
  int Skipped() const override;
  int Dropped() const override { return 0; }  // a recording waits
  void Mute();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
