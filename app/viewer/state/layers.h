#pragma once

#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "app/viewer/state/document.h"
#include "render/scene/style.h"
#include "slam/evaluation/trajectory_error.h"
#include "slam/io/point_cloud.h"
#include "slam/io/trajectory.h"

namespace sqslam::viewer {

// Layers drawn with the map that are not part of it. Panels set what is wanted; LayerSession does the rest.
struct Layers {
  bool true_path = false;            // wanted
  std::filesystem::path sequence;    // with the true path; empty: the mapped sequence
  bool dense_cloud = true;           // wanted
  bool mesh = false;                 // instead of the recording's cloud, if the style says so
  std::filesystem::path cloud_file;  // empty: the cloud of the recording, if any
  bool cloud_in_world = false;       // the file is in the frame of the true poses, else of the map

  SceneLayers drawn;        // map frame
  double path_error = 0.0;  // RMSE between keyframes and the true path, metres
  int path_pairs = 0;       // number of keyframes compared; 0: no true path
  bool reading = false;

  // Requests a dense cloud, in the map's frame unless `cloud_in_world`.
  void ShowCloud(const std::filesystem::path& file) {
    cloud_file = std::filesystem::absolute(file);
    dense_cloud = true;
  }
};

// Reads one file at a time on its own thread.
template <typename Value>
class BackgroundFile {
 public:
  using ValuePtr = std::shared_ptr<const Value>;

  // Starts reading `source` by read(source), which returns a value or a pointer that is not null, unless it
  // is read already or another file is being read.
  void Want(const std::filesystem::path& source, auto read) {
    if (!task_.valid() && (source != source_ || !value_)) {
      source_ = source;
      value_.reset();
      task_ = std::async(std::launch::async, [source, read] { return Shared(read(source)); });
    }
  }
  // Takes the value if it is ready and `source` is still wanted; returns the error, if any.
  std::optional<std::string> Take(const std::filesystem::path& source);

  bool Busy() const { return task_.valid(); }
  const ValuePtr& Get() const { return value_; }  // null until it is read
  const std::filesystem::path& Source() const { return source_; }

 private:
  static ValuePtr Shared(ValuePtr value) { return value; }
  static ValuePtr Shared(Value value) { return std::make_shared<const Value>(std::move(value)); }

  std::filesystem::path source_;
  std::future<ValuePtr> task_;
  ValuePtr value_;
};

// Reads the wanted layers and keeps them aligned with the map.
class LayerSession {
 public:
  // Must be called once a frame. Unreadable files are reported in the window and no longer wanted.
  void Update(Layers& layers, const Document& document, Messages& messages);
  bool Busy() const { return truth_.Busy() || cloud_.Busy() || own_.Busy() || mesh_.Busy(); }

 private:
  void LayOver(Layers& layers, const Document& document, Messages& messages);
  const TruePath* PathOver(const MapSnapshotPtr& map);
  CloudLayerPtr PlacedCloud(const Sim3d& S_map_file);

  BackgroundFile<Trajectory> truth_;  // of a sequence
  BackgroundFile<PointCloud> cloud_;  // of a file
  BackgroundFile<CloudLayer> own_;    // of the recording; no points if it has none

  BackgroundFile<SurfaceMesh> mesh_;  // surface of the recording

  struct {
    MapSnapshotPtr map;
    std::shared_ptr<const Trajectory> truth;
    std::optional<TruePath> path;  // empty: they cannot be aligned
  } laid_;
  struct {
    std::shared_ptr<const PointCloud> cloud;
    Sim3d S_map_file;
    CloudLayerPtr points;  // map frame
  } placed_;
};

}  // namespace sqslam::viewer
