#pragma once

#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>

#include "app/viewer/state/document.h"
#include "render/scene/style.h"
#include "slam/evaluation/trajectory_error.h"
#include "slam/io/point_cloud.h"
#include "slam/io/trajectory.h"

namespace sqslam::viewer {

// Things that are drawn with the map and are no part of it. Panels set what is wanted; LayerSession reads it
// and fills in the rest.
struct Layers {
  bool true_path = false;            // wanted
  std::filesystem::path sequence;    // whose; empty: the one that was mapped
  bool dense_cloud = true;           // wanted
  bool mesh = false;                 // in place of the recording's cloud, as the style says
  std::filesystem::path cloud_file;  // empty: the cloud that the recording has, if any
  bool cloud_in_world = false;       // the file is in the frame of the true poses, otherwise in the map's

  SceneLayers drawn;        // map frame
  double path_error = 0.0;  // RMSE between keyframes and the true path, metres
  int path_pairs = 0;       // keyframes that were compared; 0: there is none
  bool reading = false;

  // A dense cloud to be read and drawn, in the map's frame unless somebody said otherwise.
  void ShowCloud(const std::filesystem::path& file) {
    cloud_file = std::filesystem::absolute(file);
    dense_cloud = true;
  }
};

// A file that is read on a thread of its own, and another one as soon as that is wanted.
template <typename Value>
class BackgroundFile {
 public:
  using ValuePtr = std::shared_ptr<const Value>;

  // Begins to read `source` by read(source), unless it is there or something is still being read.
  void Want(const std::filesystem::path& source, auto read) {
    if (!task_.valid() && (source != source_ || !value_)) {
      source_ = source;
      value_.reset();
      task_ = std::async(std::launch::async,
                         [source, read] { return std::make_shared<const Value>(read(source)); });
    }
  }
  // Takes what was read, if it is ready and `source` is still what is wanted; returns what was wrong with it.
  std::optional<std::string> Take(const std::filesystem::path& source);

  bool Busy() const { return task_.valid(); }
  const ValuePtr& Get() const { return value_; }  // null until it is read
  const std::filesystem::path& Source() const { return source_; }

 private:
  std::filesystem::path source_;
  std::future<ValuePtr> task_;
  ValuePtr value_;
};

// Reads the layers that are wanted, and keeps them laid over the map.
class LayerSession {
 public:
  // Once a frame. Files that cannot be read are said in the window and no longer wanted.
  void Update(Layers& layers, const Document& document, Messages& messages);
  bool Busy() const { return truth_.Busy() || cloud_.Busy() || own_.Busy() || mesh_.Busy(); }

 private:
  void LayOver(Layers& layers, const Document& document, Messages& messages);
  const TruePath* PathOver(const MapSnapshotPtr& map);
  CloudLayerPtr PlacedCloud(const Sim3d& S_map_file);

  BackgroundFile<Trajectory> truth_;  // of a sequence
  BackgroundFile<PointCloud> cloud_;  // of a file
  BackgroundFile<CloudLayer> own_;    // of the recording; without points where it has none

  BackgroundFile<SurfaceMesh> mesh_;  // the same as a surface

  struct {
    MapSnapshotPtr map;
    std::shared_ptr<const Trajectory> truth;
    std::optional<TruePath> path;  // empty: the one cannot be laid over the other
  } laid_;
  struct {
    std::shared_ptr<const PointCloud> cloud;
    Sim3d S_map_file;
    CloudLayerPtr points;  // map frame
  } placed_;
};

}  // namespace sqslam::viewer
