#pragma once

#include <filesystem>
#include <optional>

#include "render/surface/surface_mesh.h"
#include "slam/dense/depth_fusion.h"

namespace sqslam::app {

// Fuses the depth maps of a densified recording (map.sqmap) into a mesh, with the options it was densified
// with. Returns nullopt if `progress` cancelled it. Throws InputError if the recording has no depth maps.
std::optional<SurfaceMesh> SurfaceOf(const std::filesystem::path& recording, int threads,
                                     const DensifyProgress& progress);

// Writes that mesh to dense.glb in the result folder. Returns false if `progress` cancelled it; an older
// dense.glb is then kept.
bool WriteSurface(const std::filesystem::path& result, int threads, const DensifyProgress& progress);

}  // namespace sqslam::app
