#pragma once

#include <filesystem>
#include <optional>

#include "render/surface/surface_mesh.h"
#include "slam/dense/depth_fusion.h"

namespace sqslam::app {

// The mesh of the depth maps in a densified recording (map.sqmap), with the options that it was densified
// with. Empty where `progress` ended it. Throws InputError where the recording has no depth maps.
std::optional<SurfaceMesh> SurfaceOf(const std::filesystem::path& recording, int threads,
                                     const DensifyProgress& progress);

// Writes that mesh to dense.glb in the result folder. Returns false where `progress` ended it: an older
// dense.glb is then left as it is.
bool WriteSurface(const std::filesystem::path& result, int threads, const DensifyProgress& progress);

}  // namespace sqslam::app
