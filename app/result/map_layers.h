#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "render/scene/scene_layers.h"
#include "slam/geometry/rigid3.h"
#include "slam/io/point_cloud.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::app {

// What is drawn with a map besides what the map holds: options of `sqslam render` and of the viewer.
struct LayerArguments {
  std::string ground_truth;               // a sequence; "auto": the one that was mapped; empty: no true path
  std::string dense_cloud;                // a file; empty: none
  std::string dense_cloud_frame = "map";  // "map", or "world": that of the true poses
};

void AddLayerOptions(CLI::App& command, LayerArguments& arguments);

// What is wrong where LayTruePath finds no way.
std::string CannotBeLaid(const std::filesystem::path& sequence);

// ReadPointCloud, but a cloud without points is an error and points that are none are told.
PointCloud ReadDenseCloud(const std::filesystem::path& file);

// A cloud in the frame of a map.
std::shared_ptr<const ColoredPoints> PlaceCloud(const PointCloud& cloud, const Sim3d& S_map_file);

// Reads what the arguments name and lays it over the finished map. `sequence`: what was mapped. Throws
// InputError that names the file, UsageError where "auto" has nothing to mean.
SceneLayers ReadLayers(const LayerArguments& arguments, const MapSnapshot& map,
                       const std::filesystem::path& sequence);

}  // namespace sqslam::app
