#include "app/viewer/state/layers.h"

#include <chrono>
#include <utility>

#include "app/result/map_input.h"
#include "slam/evaluation/ground_truth.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;
namespace {

fs::path SequenceOf(const Layers& layers, const Document& document) {
  return layers.sequence.empty() ? fs::path(document.info.sequence_path) : layers.sequence;
}

// Without the true path a cloud in the world frame cannot be placed either.
void GiveUpTruth(Layers& layers) {
  layers.true_path = false;
  layers.dense_cloud = layers.dense_cloud && !layers.cloud_in_world;
  layers.cloud_in_world = false;
}

}  // namespace

template <typename Value>
std::optional<std::string> BackgroundFile<Value>::Take(const fs::path& source) {
  if (!task_.valid() || task_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    return std::nullopt;
  }
  try {
    ValuePtr read = task_.get();
    value_ = source == source_ ? std::move(read) : nullptr;
  } catch (const std::exception& error) {
    if (source == source_) {
      return error.what();
    }
  }
  return std::nullopt;
}

void LayerSession::Update(Layers& layers, const Document& document, Messages& messages) {
  const fs::path sequence = SequenceOf(layers, document);
  if (const auto problem = truth_.Take(sequence); problem && document.last) {
    GiveUpTruth(layers);
    messages.Complain(sequence.empty() ? "The map does not say what was mapped." : *problem);
  }
  const auto fails = [&](auto& dense, const fs::path& source) {
    const std::optional<std::string> problem = dense.Take(source);
    if (problem) {
      layers.dense_cloud = false;
      messages.Complain(*problem);
    }
    return problem.has_value();
  };
  if (fails(cloud_, layers.cloud_file)) {
    layers.cloud_file.clear();
  }
  fails(own_, document.file);
  fails(mesh_, document.file);
  if (document.last) {
    if (layers.true_path || (layers.dense_cloud && layers.cloud_in_world)) {
      truth_.Want(sequence, ReadTruePoses);
    }
    if (layers.dense_cloud && !layers.cloud_file.empty()) {
      cloud_.Want(layers.cloud_file, app::ReadDenseCloud);
    } else if (std::error_code none;
               layers.dense_cloud && !document.run.active &&
               fs::is_regular_file(document.file, none)) {  // right after a run it is a folder
      own_.Want(document.file, [](const fs::path& recording) {
        const CloudLayerPtr cloud = ReadCloudLayer(recording);
        return cloud ? cloud : std::make_shared<const CloudLayer>();
      });
      if (layers.mesh) {
        mesh_.Want(document.file, [](const fs::path& recording) {
          const SurfaceMeshPtr mesh = app::ReadMesh(recording, true);
          return mesh ? mesh : std::make_shared<const SurfaceMesh>();
        });
      }
    }
  }
  layers.reading = Busy();
  if (document.last) {
    LayOver(layers, document, messages);
  }
}

// Aligns the path to each state of a growing map; a cloud in the world frame waits for the end of the run.
void LayerSession::LayOver(Layers& layers, const Document& document, Messages& messages) {
  const bool wants_path = layers.true_path && truth_.Get() != nullptr;
  const bool has_file = !layers.cloud_file.empty();
  const bool wants_cloud = layers.dense_cloud && has_file && cloud_.Get() != nullptr;
  const bool in_world =
      wants_cloud && layers.cloud_in_world && truth_.Get() != nullptr && !document.run.active;
  const TruePath* path = wants_path || in_world ? PathOver(document.last) : nullptr;
  if (path == nullptr && (wants_path || in_world) && !document.run.active) {
    GiveUpTruth(layers);
    messages.Complain(app::CannotBeLaid(truth_.Source()));
  }
  layers.path_error = path != nullptr ? path->rmse : 0.0;
  layers.path_pairs = path != nullptr ? path->pairs : 0;

  layers.drawn.true_path = path != nullptr && wants_path ? path->pieces : decltype(path->pieces)();
  std::optional<Sim3d> S_map_file;
  if (wants_cloud && !layers.cloud_in_world) {
    S_map_file = Sim3d();
  } else if (in_world && path != nullptr) {
    S_map_file = path->S_world_map.Inverse();
  }
  if (!S_map_file) {
    placed_ = {};
  }
  const bool own = layers.dense_cloud && !has_file && own_.Get() != nullptr && !own_.Get()->points.empty() &&
                   own_.Source() == document.file;
  const bool meshed = own && layers.mesh && mesh_.Get() != nullptr && mesh_.Source() == document.file;
  layers.drawn.dense_mesh = meshed ? mesh_.Get() : nullptr;
  layers.drawn.dense_cloud = S_map_file ? PlacedCloud(*S_map_file) : own ? own_.Get() : nullptr;
}

const TruePath* LayerSession::PathOver(const MapSnapshotPtr& map) {
  if (laid_.map != map || laid_.truth != truth_.Get()) {
    laid_ = {map, truth_.Get(), LayTruePath(*truth_.Get(), *map)};
  }
  return laid_.path ? &*laid_.path : nullptr;
}

CloudLayerPtr LayerSession::PlacedCloud(const Sim3d& S_map_file) {
  if (placed_.cloud != cloud_.Get() || !(placed_.S_map_file == S_map_file)) {
    placed_ = {cloud_.Get(), S_map_file,
               app::PlaceCloud(*cloud_.Get(), S_map_file, ParseColor(SceneStyle().dense_cloud.color))};
  }
  return placed_.points;
}

}  // namespace sqslam::viewer
