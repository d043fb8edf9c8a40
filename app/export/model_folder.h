#pragma once

#include <array>
#include <filesystem>
#include <functional>

namespace sqslam::app {

// Programs that take a map's keyframes as input, each with its folder layout.
enum class ModelFormat { kColmap, kNerfstudio };
constexpr auto EnumNames(ModelFormat) { return std::array{"colmap", "nerfstudio"}; }

struct ModelSummary {
  int images = 0;
  int without_image = 0;  // keyframes that were left out
  int points = 0;
  double error = 0.0;  // px, mean reprojection error
};

struct ModelRequest {
  std::filesystem::path result;
  std::filesystem::path sequence;  // where the images are now; empty: where they were mapped from
  std::filesystem::path folder;    // new
  ModelFormat format = ModelFormat::kColmap;
  bool masks = false;  // also masks/, one PNG an image: white where the map has an object, black elsewhere
};

// Writes the live map of a result into a new folder: sparse/0 for COLMAP, transforms.json and points.ply for
// nerfstudio, and images/ for both. images/ is a link to the sequence if its images are files of the camera's
// size; otherwise (videos, resized images) the images are written. `progress` is called after each written
// image. Throws InputError, and UsageError if the folder is not empty.
ModelSummary ExportModel(const ModelRequest& request,
                         const std::function<void(int done, int total)>& progress);

}  // namespace sqslam::app
