#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <vector>

#include "slam/dense/keyframe_plan.h"
#include "slam/io/trajectory.h"

namespace sqslam {

// A depth map that was estimated during a run, in the recording: what the frames that it was made from were
// thought to be.
struct LiveEstimate {
  std::int64_t keyframe = 0;     // id
  PosesByFrame T_keyframe_view;  // of these frames, in units of the depth
};

// Scale by which the estimate's depths become those of the finished map, where the relative poses that it was
// made from still hold: nothing in the middle of the depths has moved by more than half a pixel in any of the
// views, nor by the correction of a rolling shutter, which a run knows at its end. Empty where it has, or
// where a frame is no longer there.
std::optional<double> ScaleIfValid(const LiveEstimate& estimate, const DenseInput& input,
                                   std::size_t keyframe, const DepthRange& range);

// Estimates depth maps while a run goes on, on one thread of low priority: of keyframes that enough others
// have followed for their poses to have settled, the oldest first. Each is put into the recording as soon as
// it is there, with what those before it confirm of it.
class LiveDepth {
 public:
  // `recording`: the run's, which is being written. `sequence`: images in files.
  LiveDepth(const std::filesystem::path& recording, Sequence sequence, const DenseOptions& options);
  ~LiveDepth();
  LiveDepth(const LiveDepth&) = delete;
  LiveDepth& operator=(const LiveDepth&) = delete;

  // Neither waits for the thread. Any thread may call them.
  void Tracked(std::int64_t frame, const Rigid3d& T_map_camera);
  void Mapped(const MapSnapshotPtr& map);

  // Ends the work with the depth map under way, and closes the recording. Throws InputError where a depth map
  // could not be written.
  std::vector<LiveEstimate> Finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
