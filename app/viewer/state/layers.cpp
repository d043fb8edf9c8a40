#include "app/viewer/state/layers.h"

#include <utility>

#include "app/result/map_input.h"
#include "slam/evaluation/ground_truth.h"
#include "slam/util/error.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;
namespace {

fs::path SequenceOf(const Layers& layers, const Document& document) {
  return layers.sequence.empty() ? fs::path(document.info.sequence_path) : layers.sequence;
}

// Without the true path a cloud in the world frame cannot be placed either.
void DropTruth(Layers& layers) {
  layers.true_path = false;
  layers.dense_cloud = layers.dense_cloud && !layers.cloud_in_world;
  layers.cloud_in_world = false;
}

}  // namespace

void LayerSession::Update(Layers& layers, const Document& document, Messages& messages) {
  const fs::path sequence = SequenceOf(layers, document);
  const bool has_map = document.last != nullptr;
  const bool wants_truth = layers.true_path || (layers.dense_cloud && layers.cloud_in_world);
  if (const auto problem = truth_.Update(has_map && wants_truth, sequence, ReadTruePoses);
      problem && has_map) {
    DropTruth(layers);
    messages.AddError(sequence.empty()
                          ? "The recording does not name its sequence; give one with --ground-truth."
                          : *problem);
  }
  const auto check = [&](const std::optional<std::string>& problem) {
    if (problem) {
      layers.dense_cloud = false;
      messages.AddError(*problem);
    }
    return !problem;
  };
  const bool has_file = !layers.cloud_file.empty();
  if (!check(
          cloud_.Update(has_map && layers.dense_cloud && has_file, layers.cloud_file, app::ReadDenseCloud))) {
    layers.cloud_file.clear();
  }
  const bool wants_own = has_map && layers.dense_cloud && !has_file && !document.run.active;
  check(own_.Update(wants_own, document.file, [](const fs::path& recording) {
    const CloudLayerPtr cloud = ReadCloudLayer(recording);
    return cloud ? cloud : std::make_shared<const CloudLayer>();
  }));
  check(mesh_.Update(wants_own && layers.mesh, document.file, [](const fs::path& recording) {
    const SurfaceMeshPtr mesh = app::ReadMesh(recording, true);
    return mesh ? mesh : std::make_shared<const SurfaceMesh>();
  }));
  layers.reading = Busy();
  if (has_map) {
    AlignLayers(layers, document, messages);
  }
}

// Aligns the path to each state of a growing map; a cloud in the world frame waits for the end of the run.
void LayerSession::AlignLayers(Layers& layers, const Document& document, Messages& messages) {
  const bool wants_path = layers.true_path && truth_.Get() != nullptr;
  const bool has_file = !layers.cloud_file.empty();
  const bool wants_cloud = layers.dense_cloud && has_file && cloud_.Get() != nullptr;
  const bool in_world =
      wants_cloud && layers.cloud_in_world && truth_.Get() != nullptr && !document.run.active;
  const TruePath* path = wants_path || in_world ? AlignedPath(document.last) : nullptr;
  if (path == nullptr && (wants_path || in_world) && !document.run.active) {
    DropTruth(layers);
    messages.AddError(app::TruePathError(truth_.Source()));
  }
  layers.path_error = path != nullptr ? path->rmse : 0.0;
  layers.path_pairs = path != nullptr ? path->pairs : 0;

  layers.drawn.true_path = path != nullptr && wants_path ? path->pieces : decltype(path->pieces)();
  layers.drawn.truth = path != nullptr && wants_path && !document.run.active ? Compared(messages) : nullptr;
  std::optional<Sim3d> S_map_file;
  if (wants_cloud && !layers.cloud_in_world) {
    S_map_file = Sim3d();
  } else if (in_world && path != nullptr) {
    S_map_file = path->S_world_map.Inverse();
  }
  if (!S_map_file) {
    placed_ = {};
  }
  const bool own = layers.dense_cloud && !has_file && own_.Get() != nullptr && !own_.Get()->points.empty();
  layers.drawn.dense_mesh = own && layers.mesh ? mesh_.Get() : nullptr;
  layers.drawn.dense_cloud = S_map_file ? PlacedCloud(*S_map_file) : own ? own_.Get() : nullptr;
}

const TruePath* LayerSession::AlignedPath(const MapSnapshotPtr& map) {
  if (aligned_.map != map || aligned_.truth != truth_.Get()) {
    aligned_ = {map, truth_.Get(), AlignTruePath(*truth_.Get(), *map), nullptr};
  }
  return aligned_.path ? &*aligned_.path : nullptr;
}

std::shared_ptr<const MapTruth> LayerSession::Compared(Messages& messages) {
  if (!aligned_.compared) {
    try {
      aligned_.compared =
          app::CompareWithTruth(*aligned_.map, *aligned_.truth, aligned_.path->S_world_map, truth_.Source());
    } catch (const InputError& error) {
      messages.AddError(error.what());
      aligned_.compared = std::make_shared<const MapTruth>();
    }
  }
  return aligned_.compared;
}

CloudLayerPtr LayerSession::PlacedCloud(const Sim3d& S_map_file) {
  if (placed_.cloud != cloud_.Get() || !(placed_.S_map_file == S_map_file)) {
    placed_ = {cloud_.Get(), S_map_file,
               app::PlaceCloud(*cloud_.Get(), S_map_file, ParseColor(SceneStyle().dense_cloud.color))};
  }
  return placed_.points;
}

}  // namespace sqslam::viewer
