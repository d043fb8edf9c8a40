#include "app/export/surface_file.h"

#include <fmt/format.h>

#include "app/export/map_export.h"
#include "slam/dense/surface_fusion.h"
#include "slam/snapshot/recording.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace fs = std::filesystem;

std::optional<SurfaceMesh> SurfaceOf(const fs::path& recording, int threads,
                                     const DensifyProgress& progress) {
  const DepthRecording depths(recording);
  if (depths.Keyframes().empty()) {
    throw InputError(
        fmt::format("{}: holds no depth maps, expected those of sqslam densify", recording.string()));
  }
  SurfaceOptions options;
  if (const std::string text = depths.Text(kSurfaceOptions); !text.empty()) {
    ParseOptions(text, recording.string(), options);
  }
  const std::optional<SurfaceVolume> volume = FuseSurface(depths, options, threads, progress);
  return volume ? std::optional(MarchSurface(*volume, options)) : std::nullopt;
}

bool WriteSurface(const fs::path& result, int threads, const DensifyProgress& progress) {
  const fs::path recording = result / "map.sqmap";
  const std::optional<SurfaceMesh> mesh = SurfaceOf(recording, threads, progress);
  if (mesh) {
    WriteFileAtomically(result / "dense.glb",
                        SurfaceGlb(*RecordingReader(recording).Last(), *mesh, "sqslam " SQSLAM_VERSION));
  }
  return mesh.has_value();
}

}  // namespace sqslam::app
