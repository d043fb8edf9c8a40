#pragma once

#include <future>
#include <memory>
#include <optional>
#include <string>

#include "app/viewer/state/viewer_state.h"
#include "slam/evaluation/true_path.h"
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
  const TruePath* PathOver(const MapSnapshotPtr& map);
  std::shared_ptr<const ColoredPoints> PlacedCloud(const Sim3d& S_map_file);

  std::filesystem::path truth_of_;  // the sequence that truth_ is of, or is being read from
  std::future<Truth> truth_task_;
  Truth truth_;
  std::filesystem::path cloud_of_;
  std::future<Cloud> cloud_task_;
  Cloud cloud_;

  struct {
    MapSnapshotPtr map;
    Truth truth;
    std::optional<TruePath> path;  // empty: the one cannot be laid over the other
  } laid_;
  struct {
    Cloud cloud;
    Sim3d S_map_file;
    std::shared_ptr<const ColoredPoints> points;  // map frame
  } placed_;
};

}  // namespace sqslam::viewer
