#pragma once

#include <filesystem>

#include "slam/run/run_host.h"

namespace sqslam {

// Makes one result of two whose maps show a common place (MergeMaps), in a folder of its own, with the
// options of the first. The results stay as they are. Throws InputError, NoMapError and UsageError before
// anything is written.
FinishedRun MergeResults(const std::filesystem::path& first, const std::filesystem::path& second,
                         const std::filesystem::path& output, RunHost& host);

}  // namespace sqslam
