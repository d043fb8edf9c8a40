#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "slam/objects/object_options.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Objects of a finished run, estimated again with its dense cloud.
struct DenseObjects {
  MapSnapshotPtr map;                // with the new estimates; null if no object changed
  std::vector<std::string> changed;  // "4 vase"

  std::string Text() const;  // one line
};

// Estimates the objects of a result again with the points of its dense.ply as further evidence (see
// slam/objects/dense_evidence.h). Their observations come from the recording: boxes of frames, and map
// points. If an estimate changes, rewrites objects.json and appends a state to the recording. Objects without
// refinement (method paper, other representations) stay as they are. Throws InputError.
DenseObjects RefineObjectsWithCloud(const std::filesystem::path& result, const ObjectOptions& options);

}  // namespace sqslam
