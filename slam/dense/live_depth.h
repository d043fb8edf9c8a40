#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "slam/dense/keyframe_plan.h"
#include "slam/io/trajectory.h"

namespace sqslam {

// Settings and views that a depth map was estimated with during a run. The recording keeps them beside it, so
// that the map holds for whoever densifies the result, also after a run that was stopped.
struct LiveEstimate {
  std::string settings;          // see EstimationSettings
  PosesByFrame T_keyframe_view;  // of the frames as they were thought to be, in units of the depth

  std::string Text() const;
  // Empty where the text is that of another kind of depth map.
  static std::optional<LiveEstimate> FromText(const std::string& text);
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

  // Ends the work with the depth map under way, and closes the recording. Returns how many there are; throws
  // InputError where one could not be written.
  int Finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
