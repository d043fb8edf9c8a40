#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "slam/dense/dense_options.h"
#include "slam/dense/depth_fusion.h"

namespace sqslam {

struct DensifyRequest {
  std::filesystem::path result;  // folder of a run
  std::filesystem::path images =
      {};  // the sequence that was mapped, where it has moved; empty: as the run says
  DenseOptions options;
  int threads = 0;       // 0: as many as the machine runs at a time
  bool estimate = true;  // false: makes the cloud of the depth maps that there are, of a run that was stopped
};

struct DensifySummary {
  int keyframes = 0;
  int estimated = 0;  // depth maps that were estimated now
  int live = 0;       // that the run itself had estimated, and that still hold
  int resumed = 0;    // and those that an earlier call had estimated with the same settings
  int without = 0;    // keyframes without depth: too few map points, views or images
  std::size_t points = 0;
  double complete = 0.0;  // share of the pixels of all keyframes that have a depth, measured
  double filled = 0.0;    // and by planes
  bool interrupted = false;

  std::string Text() const;  // one line
};

// Makes a dense cloud of a finished run: depth maps of its keyframes, in parallel; what of each the others
// confirm; the points of all. Writes the depth maps into the recording and the cloud to dense.ply. The result
// does not depend on the number of threads. Takes about 35 MiB a thread and 60 MiB beside at half of VGA's
// size.
//
// Throws InputError (no result, no images, disk full), UsageError (options), NoMapError where no depth comes
// out: a camera that did not move sideways, too few keyframes.
DensifySummary Densify(const DensifyRequest& request, const DensifyProgress& progress);

}  // namespace sqslam
