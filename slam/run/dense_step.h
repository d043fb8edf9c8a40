#pragma once

#include <filesystem>

#include "slam/dense/dense_options.h"
#include "slam/run/run_host.h"

namespace sqslam {

// Makes depth maps and a dense cloud of a finished run, gives its objects their parts, and has the host make
// a mesh. `live`: depth maps that the run itself has made. A stopped run makes no others; those made until
// then are merged. If not all images exist as files, the depth maps of `known` are kept: the recording that
// the run extended, if any. Warns if there is no depth, and leaves the map as it is. Throws InputError if a
// file cannot be read or written.
void MakeDense(FinishedRun& run, const DenseOptions& options, int live, RunHost& host,
               const std::filesystem::path& known = {});

}  // namespace sqslam
