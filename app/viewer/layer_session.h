#pragma once

#include <future>
#include <memory>
#include <optional>
#include <string>

#include "app/viewer/viewer_state.h"
#include "slam/io/point_cloud.h"
#include "slam/io/trajectory.h"

namespace sqslam::viewer {

// Reads what ViewerState::layers asks for, on threads of its own, and keeps it laid over the map.
class LayerSession {
 public:
  // Once a frame. What cannot be read is said in the window and no longer wanted.
  void Update(ViewerState& state);
  bool Busy() const { return truth_task_.valid() || cloud_task_.valid(); }

 private:
  using Truth = std::shared_ptr<const Trajectory>;
  using Cloud = std::shared_ptr<const PointCloud>;

  void TakeTruth(ViewerState& state);
  void TakeCloud(ViewerState& state);
  void GiveUpTruth(ViewerState& state, const std::string& why);
  void ReadTruth(ViewerState& state);
  void ReadCloud(ViewerState& state);
  void LayOver(ViewerState& state);

  std::filesystem::path truth_of_;  // the sequence that truth_ is of, or is being read from
  std::future<Truth> truth_task_;
  Truth truth_;
  std::filesystem::path cloud_of_;
  std::future<Cloud> cloud_task_;
  Cloud cloud_;

  // What lies in Layers::drawn.
  MapSnapshotPtr laid_map_;
  Truth laid_truth_;
  bool laid_path_ = false;
  Cloud placed_;
  std::optional<Sim3d> placed_by_;
  bool placed_in_world_ = false;
};

}  // namespace sqslam::viewer
