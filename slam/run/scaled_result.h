#pragma once

#include <filesystem>
#include <optional>

#include "slam/run/run_host.h"
#include "slam/snapshot/map_scale.h"

namespace sqslam {

// Keeps a scale in the recording of a result folder in place of the one that is there, or takes that away,
// and writes trajectory.txt, keyframes.txt, points.ply, objects.json and dense.ply anew, those that are
// there: in metres, or in the map's units. The live map and submaps keep theirs. Throws InputError.
void ScaleResult(const std::filesystem::path& result, const std::optional<MapScale>& scale);

// The same for a run that has just written its files; its values follow.
void ScaleRun(const MapScale& scale, FinishedRun& run);

}  // namespace sqslam
