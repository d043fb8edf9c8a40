#pragma once

#include <optional>

#include "slam/dense/dense_options.h"
#include "slam/dense/depth_fusion.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/surface_volume.h"

namespace sqslam {

// Name of the options, as YAML, that the mesh of a densified recording is made with (DepthRecording::Text).
inline constexpr const char* kSurfaceOptions = "surface";

// Fuses the kept depth maps of a recording into a volume. Each pixel counts by the number of depth maps that
// agree with it over its squared depth; what a ray passes on its way to the surface is held free. The voxels
// grow where the volume would take more than its share of memory. The same with any number of threads (0: as
// many as the machine runs at a time). Empty where `progress` ended it or the recording has no depth maps.
std::optional<SurfaceVolume> FuseSurface(const DepthRecording& depths, const SurfaceOptions& options,
                                         int threads, const DensifyProgress& progress);

// Takes a depth map into the blocks of a volume. `truncation`: map units.
void IntegrateDepth(const DepthMap& map, double truncation, std::size_t first_block, std::size_t end_block,
                    SurfaceVolume& volume);

}  // namespace sqslam
