#include "app/viewer/state/layers.h"

#include <chrono>
#include <utility>

#include "app/result/map_input.h"
#include "slam/evaluation/ground_truth.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;
namespace {

template <typename Task>
bool Ready(const Task& task) {
  return task.valid() && task.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

fs::path SequenceOf(const Layers& layers, const Document& document) {
  return layers.sequence.empty() ? fs::path(document.info.sequence_path) : layers.sequence;
}

// Without the truth a cloud in the world has no place either.
void GiveUpTruth(Layers& layers) {
  layers.true_path = false;
  layers.dense_cloud = layers.dense_cloud && !layers.cloud_in_world;
  layers.cloud_in_world = false;
}

}  // namespace

void LayerSession::Update(Layers& layers, const Document& document, Messages& messages) {
  TakeTruth(layers, document, messages);
  TakeCloud(layers, messages);
  if (document.last) {
    Read(layers, SequenceOf(layers, document));
  }
  layers.reading = Busy();
  if (document.last) {
    LayOver(layers, document, messages);
  }
}

// A result that is not wanted any more is forgotten, and so is what was wrong with it.
void LayerSession::TakeTruth(Layers& layers, const Document& document, Messages& messages) {
  if (!Ready(truth_task_)) {
    return;
  }
  const bool wanted = document.last && SequenceOf(layers, document) == truth_of_;
  try {
    Truth truth = truth_task_.get();
    truth_ = wanted ? std::move(truth) : nullptr;
  } catch (const std::exception& error) {
    if (wanted) {
      GiveUpTruth(layers);
      messages.Complain(truth_of_.empty() ? "The map does not say what was mapped." : error.what());
    }
  }
}

void LayerSession::TakeCloud(Layers& layers, Messages& messages) {
  if (!Ready(cloud_task_)) {
    return;
  }
  const bool wanted = layers.cloud_file == cloud_of_;
  try {
    Cloud cloud = cloud_task_.get();
    cloud_ = wanted ? std::move(cloud) : nullptr;
  } catch (const std::exception& error) {
    if (wanted) {
      layers.dense_cloud = false;
      layers.cloud_file.clear();
      messages.Complain(error.what());
    }
  }
}

void LayerSession::Read(const Layers& layers, const fs::path& sequence) {
  const bool needs_truth = layers.true_path || (layers.dense_cloud && layers.cloud_in_world);
  if (needs_truth && !truth_task_.valid() && (sequence != truth_of_ || !truth_)) {
    truth_of_ = sequence;
    truth_.reset();
    truth_task_ = std::async(std::launch::async, [sequence] {
      return std::make_shared<const Trajectory>(ReadTruePoses(sequence));
    });
  }
  const bool needs_cloud = layers.dense_cloud && !layers.cloud_file.empty();
  if (needs_cloud && !cloud_task_.valid() && (layers.cloud_file != cloud_of_ || !cloud_)) {
    cloud_of_ = layers.cloud_file;
    cloud_.reset();
    cloud_task_ = std::async(std::launch::async, [file = cloud_of_] {
      return std::make_shared<const PointCloud>(app::ReadDenseCloud(file));
    });
  }
}

// The path follows every new state of a growing map. A cloud in the world waits for the end of the run.
void LayerSession::LayOver(Layers& layers, const Document& document, Messages& messages) {
  const bool wants_path = layers.true_path && truth_ != nullptr;
  const bool wants_cloud = layers.dense_cloud && cloud_ != nullptr;
  const bool in_world = wants_cloud && layers.cloud_in_world && truth_ != nullptr && !document.run.active;
  const TruePath* path = wants_path || in_world ? PathOver(document.last) : nullptr;
  if (path == nullptr && (wants_path || in_world) && !document.run.active) {
    GiveUpTruth(layers);
    messages.Complain(app::CannotBeLaid(truth_of_));
  }
  layers.path_error = path != nullptr ? path->rmse : 0.0;
  layers.path_pairs = path != nullptr ? path->pairs : 0;

  SceneLayers drawn = *layers.drawn;
  drawn.true_path = path != nullptr && wants_path ? path->pieces : decltype(drawn.true_path)();
  std::optional<Sim3d> S_map_file;
  if (wants_cloud && !layers.cloud_in_world) {
    S_map_file = Sim3d();
  } else if (in_world && path != nullptr) {
    S_map_file = path->S_world_map.Inverse();
  }
  if (!S_map_file) {
    placed_ = {};
  }
  drawn.dense_cloud = S_map_file ? PlacedCloud(*S_map_file) : nullptr;
  if (!(drawn == *layers.drawn)) {
    layers.drawn.Set(std::move(drawn));
  }
}

const TruePath* LayerSession::PathOver(const MapSnapshotPtr& map) {
  if (laid_.map != map || laid_.truth != truth_) {
    laid_ = {map, truth_, LayTruePath(*truth_, *map)};
  }
  return laid_.path ? &*laid_.path : nullptr;
}

std::shared_ptr<const ColoredPoints> LayerSession::PlacedCloud(const Sim3d& S_map_file) {
  if (placed_.cloud != cloud_ || !(placed_.S_map_file == S_map_file)) {
    placed_ = {cloud_, S_map_file, app::PlaceCloud(*cloud_, S_map_file)};
  }
  return placed_.points;
}

}  // namespace sqslam::viewer
