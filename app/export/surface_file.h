#pragma once

#include <filesystem>
#include <optional>

#include "render/surface/surface_mesh.h"
#include "slam/dense/depth_fusion.h"

namespace sqslam::app {

// The mesh of the depth maps in a densified recording (map.sqmap). Empty where `progress` ended it. Throws
// InputError where the recording has no depth maps.
std::optional<SurfaceMesh> SurfaceOf(const std::filesystem::path& recording, const SurfaceOptions& options,
                                     int threads, const DensifyProgress& progress);

// Writes that mesh to dense.glb in the result folder. Returns false where `progress` ended it: an older
// dense.glb is then left as it is.
bool WriteSurface(const std::filesystem::path& result, const SurfaceOptions& options, int threads,
                  const DensifyProgress& progress);

}  // namespace sqslam::app
