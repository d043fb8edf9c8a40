#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "slam/dense/dense_options.h"
#include "slam/dense/depth_fusion.h"
#include "slam/util/shard.h"

namespace sqslam {

struct DensifyRequest {
  std::filesystem::path result;       // folder of a run
  std::filesystem::path images = {};  // the mapped sequence, if it has moved; empty: where the run says
  DenseOptions options;
  int threads = 0;       // 0: all hardware threads
  bool estimate = true;  // false: uses only existing depth maps, such as those of a stopped run
  std::vector<std::filesystem::path> pieces = {};  // of EstimatePiece(), whose depth maps are copied
};

struct DensifySummary {
  int keyframes = 0;
  int estimated = 0;  // depth maps estimated now
  int live = 0;       // depth maps of the run itself that are still valid
  int resumed = 0;    // depth maps that an earlier call estimated with the same settings
  int without = 0;    // keyframes without depth: too few map points, views or images
  std::size_t points = 0;
  double complete = 0.0;  // share of the pixels of all keyframes with a measured depth
  double filled = 0.0;    // share with a depth from a plane
  bool interrupted = false;

  std::string Text() const;  // one line
};

// Makes a dense cloud of a finished run: estimates depth maps of its keyframes in parallel, keeps depths
// that others confirm, and merges the points. Writes the depth maps into the recording and the cloud to
// dense.ply. The result does not depend on the number of threads. Takes about 60 MiB plus 35 MiB per thread
// at half of VGA's size.
//
// Throws InputError (no result, no images, disk full), UsageError (options), NoMapError if no depth results:
// a camera that did not move sideways, too few keyframes.
DensifySummary Densify(const DensifyRequest& request, const DensifyProgress& progress);

// Estimates the depth maps that the result lacks for one shard of the keyframes, and writes them to a
// new recording `piece`; the result is only read. Returns false if `progress` stopped it. Throws as
// Densify().
bool EstimatePiece(const DensifyRequest& request, const Shard& shard, const std::filesystem::path& piece,
                   const DensifyProgress& progress);

// Returns a fingerprint of all inputs of the depth maps except the images. Throws as Densify().
std::string DepthFingerprint(const DensifyRequest& request);

}  // namespace sqslam
