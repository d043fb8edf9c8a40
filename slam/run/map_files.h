#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "slam/io/result_files.h"
#include "slam/run/run_host.h"
#include "slam/snapshot/map_scale.h"
#include "slam/system.h"

namespace sqslam {

// Runs every step even if one fails, to save what can be saved (full disk, no display), then throws the first
// failure.
void AttemptAll(const std::vector<std::function<void()>>& steps);

// Writes trajectory.txt, keyframes.txt, points.ply and objects.json of the map, and the same files of each
// unconnected map in submaps/1, submaps/2, ..., in its own frame and scale.
void WriteMapFiles(const std::filesystem::path& folder, const RunResult& result);

// Writes relations.json of a result folder: how the objects of its finished map stand to each other, to
// surfaces and, with a dense cloud, to walls. Throws InputError.
void WriteRelations(const std::filesystem::path& result);

// Returns the counts and times of a result for stats.json, with this process's peak memory so far.
RunStats StatsOf(const RunResult& result);

// Replaces or removes the scale in the recording of a result folder, then rewrites those of trajectory.txt,
// keyframes.txt, points.ply, objects.json, dense.ply and relations.json that exist: in metres, or in the
// map's units. Each file is replaced whole; calling this again completes an interrupted call. The live map
// and submaps keep their units. Throws InputError.
void ScaleResult(const std::filesystem::path& result, const std::optional<MapScale>& scale);

// Same for a run that has just written its files; also scales the values of `run`.
void ScaleRun(const MapScale& scale, FinishedRun& run);

}  // namespace sqslam
