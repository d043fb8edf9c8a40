#pragma once

#include <chrono>
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

// Layers drawn with the map that are not part of it. Panels set the wishes; LayerSession reads and aligns.
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

  // Takes the value if it is ready, and starts reading `source` by read(source) if it is wanted and not read
  // yet; read() returns a value, or a pointer that is not null. Returns the error if `source` cannot be read.
  std::optional<std::string> Update(bool wanted, const std::filesystem::path& source, auto read) {
    std::optional<std::string> problem;
    if (task_.valid() && task_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
      try {
        value_ = task_.get();
      } catch (const std::exception& error) {
        problem = error.what();
      }
    }
    if (source != source_) {
      value_.reset();
      problem.reset();
    }
    if (wanted && !problem && !value_ && !task_.valid()) {
      source_ = source;
      task_ = std::async(std::launch::async, [source, read] { return Shared(read(source)); });
    }
    return problem;
  }

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
  void AlignLayers(Layers& layers, const Document& document, Messages& messages);
  const TruePath* AlignedPath(const MapSnapshotPtr& map);
  std::shared_ptr<const MapTruth> Compared(Messages& messages);  // of the aligned path
  CloudLayerPtr PlacedCloud(const Sim3d& S_map_file);

  BackgroundFile<Trajectory> truth_;  // of a sequence
  BackgroundFile<PointCloud> cloud_;  // of a file
  BackgroundFile<CloudLayer> own_;    // of the recording; no points if it has none

  BackgroundFile<SurfaceMesh> mesh_;  // surface of the recording

  struct {
    MapSnapshotPtr map;
    std::shared_ptr<const Trajectory> truth;
    std::optional<TruePath> path;              // empty: they cannot be aligned
    std::shared_ptr<const MapTruth> compared;  // null: not yet
  } aligned_;
  struct {
    std::shared_ptr<const PointCloud> cloud;
    Sim3d S_map_file;
    CloudLayerPtr points;  // map frame
  } placed_;
};

}  // namespace sqslam::viewer
