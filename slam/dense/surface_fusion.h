#pragma once

#include <optional>

#include "slam/dense/dense_options.h"
#include "slam/dense/depth_fusion.h"
#include "slam/snapshot/depth_map.h"
#include "slam/snapshot/depth_recording.h"

namespace sqslam {

// Key of the mesh options, as YAML, in a densified recording (DepthRecording::Text).
inline constexpr const char* kSurfaceOptions = "surface";

inline constexpr double kTruncation = 4.0;  // voxels in front of and behind a measured depth

// Fuses the kept depth maps of a recording into a volume. A pixel's weight is its inverse variance; the
// ray in front of a surface is free space. Voxels grow if the volume would exceed its memory. The result does
// not depend on the number of threads (0: all hardware threads). Returns nothing if `progress` ended it or
// there are no depth maps.
std::optional<SurfaceVolume> FuseSurface(const DepthRecording& depths, const SurfaceOptions& options,
                                         int threads, const DensifyProgress& progress);

}  // namespace sqslam
