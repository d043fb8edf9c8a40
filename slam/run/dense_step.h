#pragma once

#include "slam/dense/dense_options.h"
#include "slam/run/run_host.h"

namespace sqslam {

// Makes depth maps and a dense cloud of a finished run, and has the host make a mesh. `live`: depth maps that
// the run itself has made. A stopped run makes no others; those made until then are merged. Without depth, or
// if the images of an earlier part are gone, warns and leaves the map as it is. Throws InputError if a file
// cannot be read or written.
void MakeDense(const FinishedRun& run, const DenseOptions& options, int live, RunHost& host);

}  // namespace sqslam
