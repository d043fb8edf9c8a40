#include "app/viewer/layer_session.h"

#include <chrono>
#include <utility>

#include "app/map_layers.h"
#include "slam/evaluation/true_path.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;
namespace {

template <typename Task>
bool Ready(const Task& task) {
  return task.valid() && task.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

fs::path SequenceOf(const ViewerState& state) {
  return state.layers.sequence.empty() ? fs::path(state.document.info.sequence_path) : state.layers.sequence;
}

}  // namespace

void LayerSession::Update(ViewerState& state) {
  TakeTruth(state);
  TakeCloud(state);
  if (state.document.last) {
    ReadTruth(state);
    ReadCloud(state);
  }
  state.layers.reading = Busy();
  if (state.document.last) {
    LayOver(state);
  }
}

// What comes of something that is not wanted any more is forgotten, and so is what was wrong with it.
void LayerSession::TakeTruth(ViewerState& state) {
  if (!Ready(truth_task_)) {
    return;
  }
  const bool wanted = state.document.last && SequenceOf(state) == truth_of_;
  try {
    Truth truth = truth_task_.get();
    truth_ = wanted ? std::move(truth) : nullptr;
  } catch (const std::exception& error) {
    if (wanted) {
      GiveUpTruth(state, truth_of_.empty() ? "The map does not say what was mapped." : error.what());
    }
  }
}

void LayerSession::TakeCloud(ViewerState& state) {
  if (!Ready(cloud_task_)) {
    return;
  }
  const bool wanted = state.layers.cloud_file == cloud_of_;
  try {
    Cloud cloud = cloud_task_.get();
    cloud_ = wanted ? std::move(cloud) : nullptr;
  } catch (const std::exception& error) {
    if (wanted) {
      state.layers.dense_cloud = false;
      state.layers.cloud_file.clear();
      state.Complain(error.what());
    }
  }
}

// Without it a cloud in the world has no place either.
void LayerSession::GiveUpTruth(ViewerState& state, const std::string& why) {
  Layers& layers = state.layers;
  layers.true_path = false;
  layers.dense_cloud = layers.dense_cloud && !layers.cloud_in_world;
  layers.cloud_in_world = false;
  state.Complain(why);
}

void LayerSession::ReadTruth(ViewerState& state) {
  const Layers& layers = state.layers;
  const bool needed = layers.true_path || (layers.dense_cloud && layers.cloud_in_world);
  const fs::path sequence = SequenceOf(state);
  if (needed && !truth_task_.valid() && (sequence != truth_of_ || !truth_)) {
    truth_of_ = sequence;
    truth_.reset();
    truth_task_ = std::async(std::launch::async, [sequence] {
      return std::make_shared<const Trajectory>(ReadTruePoses(sequence));
    });
  }
}

void LayerSession::ReadCloud(ViewerState& state) {
  const Layers& layers = state.layers;
  const bool needed = layers.dense_cloud && !layers.cloud_file.empty();
  if (needed && !cloud_task_.valid() && (layers.cloud_file != cloud_of_ || !cloud_)) {
    cloud_of_ = layers.cloud_file;
    cloud_.reset();
    cloud_task_ = std::async(std::launch::async, [file = cloud_of_] {
      return std::make_shared<const PointCloud>(app::ReadDenseCloud(file));
    });
  }
}

// The path follows every new state of a growing map. A cloud in the world waits for the end of the run.
void LayerSession::LayOver(ViewerState& state) {
  Layers& layers = state.layers;
  const bool wants_path = layers.true_path && truth_ != nullptr;
  const bool wants_cloud = layers.dense_cloud && cloud_ != nullptr;
  std::optional<Sim3d> S_map_file;
  SceneLayers drawn = layers.drawn;
  const bool path_is_new =
      laid_path_ != wants_path || laid_truth_ != truth_ || laid_map_ != state.document.last;
  const bool in_world = wants_cloud && layers.cloud_in_world && truth_ != nullptr && !state.run.active;
  if (wants_cloud && !layers.cloud_in_world) {
    S_map_file = Sim3d();
  }
  const bool place_anew = in_world && (placed_ != cloud_ || !placed_in_world_);
  if (in_world && placed_in_world_) {
    S_map_file = placed_by_;
  }
  if (path_is_new || place_anew) {
    const std::optional<TruePath> path =
        wants_path || in_world ? LayTruePath(*truth_, *state.document.last) : std::nullopt;
    if (!path && (wants_path || in_world) && !state.run.active) {
      GiveUpTruth(state, app::CannotBeLaid(truth_of_));
    }
    drawn.true_path = path && wants_path ? path->pieces : decltype(drawn.true_path)();
    layers.path_error = path ? path->rmse : 0.0;
    layers.path_pairs = path ? path->pairs : 0;
    if (in_world && path) {
      S_map_file = path->S_world_map.Inverse();
    }
    laid_path_ = wants_path;
    laid_truth_ = truth_;
    laid_map_ = state.document.last;
  }
  const bool shows_cloud = wants_cloud && S_map_file.has_value();
  if (!shows_cloud) {
    drawn.dense_cloud.reset();
    placed_.reset();
  } else if (placed_ != cloud_ || placed_by_ != S_map_file) {
    drawn.dense_cloud = app::PlaceCloud(*cloud_, *S_map_file);
    placed_ = cloud_;
    placed_by_ = S_map_file;
  }
  placed_in_world_ = shows_cloud && in_world;
  if (!(drawn == layers.drawn)) {
    layers.drawn = std::move(drawn);
    ++layers.version;
  }
}

}  // namespace sqslam::viewer
