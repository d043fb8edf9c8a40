#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "slam/io/result_files.h"
#include "slam/system.h"

namespace sqslam {

// Runs every step even if one fails, to save what can be saved (full disk, no display), then throws the first
// failure.
void AttemptAll(const std::vector<std::function<void()>>& steps);

// Writes trajectory.txt, keyframes.txt, points.ply and objects.json of the map, and the same files of each
// unconnected map in submaps/1, submaps/2, ..., in its own frame and scale.
void WriteMapFiles(const std::filesystem::path& folder, const RunResult& result);

// Returns the counts and times of a result for stats.json, with this process's peak memory so far.
RunStats StatsOf(const RunResult& result);

}  // namespace sqslam
