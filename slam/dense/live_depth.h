#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "slam/dense/dense_input.h"
#include "slam/io/trajectory.h"

namespace sqslam {

// Settings and views of a depth map that was estimated during a run. The recording keeps them with the map,
// which densifying the result can then reuse, even if the run was stopped.
struct LiveEstimate {
  std::string settings;          // see EstimationSettings
  PosesByFrame T_keyframe_view;  // as estimated at that time, in units of the depth

  std::string Text() const;
  // Returns nothing if the text is that of another kind of depth map.
  static std::optional<LiveEstimate> FromText(const std::string& text);
};

// Returns the scale from the estimate's depths to those of the finished map, if its relative poses still
// hold: neither optimisation nor the rolling shutter correction, which is only known at the end of a run,
// moved a point at the middle depth by over half a pixel in any view. Returns nothing otherwise, or if a
// frame no longer exists.
std::optional<double> ScaleIfValid(const LiveEstimate& estimate, const DenseInput& input,
                                   std::size_t keyframe, const DepthRange& range);

// Estimates depth maps during a run, on one thread of low priority: of keyframes that are old enough for
// their poses to have settled, oldest first. Each is recorded at once, filtered by the ones before it.
class LiveDepth {
 public:
  // `recording`: of the run, which is writing it. `sequence`: image files.
  LiveDepth(const std::filesystem::path& recording, Sequence sequence, const DenseOptions& options);
  ~LiveDepth();
  LiveDepth(const LiveDepth&) = delete;
  LiveDepth& operator=(const LiveDepth&) = delete;

  // Neither waits for the thread. Thread-safe.
  void Tracked(std::int64_t frame, const Rigid3d& T_map_camera);
  void Mapped(const MapSnapshotPtr& map);

  // Completes the depth map in progress and closes the recording. Returns the number of depth maps. Throws
  // InputError if one could not be written.
  int Finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
