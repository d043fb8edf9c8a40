#pragma once

#include <filesystem>
#include <optional>

#include "slam/run/run_host.h"
#include "slam/snapshot/map_scale.h"

namespace sqslam {

// Replaces or removes the scale in the recording of a result folder, and rewrites those of trajectory.txt,
// keyframes.txt, points.ply, objects.json and dense.ply that exist: in metres, or in the map's units. The
// live map and submaps keep their units. Throws InputError.
void ScaleResult(const std::filesystem::path& result, const std::optional<MapScale>& scale);

// Same for a run that has just written its files; also scales the values of `run`.
void ScaleRun(const MapScale& scale, FinishedRun& run);

}  // namespace sqslam
