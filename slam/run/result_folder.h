#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "slam/mapping/finished_map.h"

namespace sqslam {

// Runs every step even if one fails, so that a full disk or a missing display costs no more than it must; the
// first failure is thrown at the end.
void AttemptAll(const std::vector<std::function<void()>>& steps);

// trajectory.txt, keyframes.txt, points.ply and objects.json. Throws InputError where one cannot be written,
// after the others have been.
void WriteMapFiles(const std::filesystem::path& folder, const FinishedMap& map);

// Maps that could not be tied to the main one: the same files in submaps/1, submaps/2, ... of the result
// folder, each in a frame and scale of its own.
void WriteSubmaps(const std::filesystem::path& folder, const std::vector<FinishedMap>& submaps);

}  // namespace sqslam
