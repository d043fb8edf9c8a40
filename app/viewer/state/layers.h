#pragma once

#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>

#include "app/viewer/state/document.h"
#include "app/viewer/state/observed.h"
#include "app/viewer/state/requests.h"
#include "render/scene/scene_layers.h"
#include "slam/evaluation/trajectory_error.h"
#include "slam/io/point_cloud.h"
#include "slam/io/trajectory.h"

namespace sqslam::viewer {

// Things that are drawn with the map and are no part of it. Panels set what is wanted; LayerSession reads it
// and fills in the rest.
struct Layers {
  bool true_path = false;          // wanted
  std::filesystem::path sequence;  // whose; empty: the one that was mapped
  bool dense_cloud = false;        // wanted
  std::filesystem::path cloud_file;
  bool cloud_in_world = false;  // the file is in the frame of the true poses, otherwise in the map's

  Observed<SceneLayers> drawn;  // map frame
  double path_error = 0.0;      // RMSE between keyframes and the true path, metres
  int path_pairs = 0;           // keyframes that were compared; 0: there is none
  bool reading = false;

  // A dense cloud to be read and drawn, in the map's frame unless somebody said otherwise.
  void ShowCloud(const std::filesystem::path& file) {
    cloud_file = std::filesystem::absolute(file);
    dense_cloud = true;
  }
};

// Tells by its name whether a file can be a dense cloud.
inline bool IsCloudFile(const std::filesystem::path& file) {
  return file.extension() == ".ply" || file.extension() == ".PLY";
}

// Reads the layers that are wanted on threads of its own, and keeps them laid over the map.
class LayerSession {
 public:
  // Once a frame. What cannot be read is said in the window and no longer wanted.
  void Update(Layers& layers, const Document& document, Messages& messages);
  bool Busy() const { return truth_task_.valid() || cloud_task_.valid(); }

 private:
  using Truth = std::shared_ptr<const Trajectory>;
  using Cloud = std::shared_ptr<const PointCloud>;

  void TakeTruth(Layers& layers, const Document& document, Messages& messages);
  void TakeCloud(Layers& layers, Messages& messages);
  void Read(const Layers& layers, const std::filesystem::path& sequence);
  void LayOver(Layers& layers, const Document& document, Messages& messages);
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
