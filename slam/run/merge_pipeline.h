#pragma once

#include <filesystem>

#include "slam/run/run_host.h"

namespace sqslam {

// Merges two results whose maps share a place (MergeMaps) into a new folder, with the options of the first.
// The two stay unchanged. Throws InputError, NoMapError and UsageError before anything is written.
FinishedRun MergeResults(const std::filesystem::path& first, const std::filesystem::path& second,
                         const std::filesystem::path& output, RunHost& host);

}  // namespace sqslam
