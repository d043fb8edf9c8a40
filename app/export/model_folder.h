#pragma once

#include <array>
#include <filesystem>
#include <functional>

namespace sqslam::app {

// Programs that go on from a map's keyframes, and their layouts of a folder.
enum class ModelFormat { kColmap, kNerfstudio };
constexpr auto EnumNames(ModelFormat) { return std::array{"colmap", "nerfstudio"}; }

struct ModelSummary {
  int images = 0;
  int without_image = 0;  // keyframes that were left out
  int points = 0;
  double error = 0.0;  // px, mean reprojection error
};

// Writes the live map of a result into a new folder: for COLMAP sparse/0, for nerfstudio transforms.json and
// points.ply, and images/ for both. That is a link to the sequence where its images are files of the camera's
// size; otherwise (videos, resized images) they are written. `sequence`: where the images are now; empty:
// where they were when they were mapped. `progress` hears how many of how many are written. Throws
// InputError, and UsageError where the folder is not empty.
ModelSummary ExportModel(const std::filesystem::path& result, const std::filesystem::path& sequence,
                         const std::filesystem::path& folder, ModelFormat format,
                         const std::function<void(int done, int total)>& progress);

}  // namespace sqslam::app
