#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "slam/io/result_files.h"
#include "slam/system.h"

namespace sqslam {

// Runs every step even if one fails, so that a full disk or a missing display costs no more than it must; the
// first failure is thrown at the end.
void AttemptAll(const std::vector<std::function<void()>>& steps);

// Writes trajectory.txt, keyframes.txt, points.ply and objects.json of the map; of the maps that could not be
// tied to it the same files in submaps/1, submaps/2, ..., each in a frame and scale of its own.
void WriteMapFiles(const std::filesystem::path& folder, const RunResult& result);

// Counts and times of a result as stats.json has them; the memory is that of this process until now.
RunStats StatsOf(const RunResult& result);

}  // namespace sqslam
