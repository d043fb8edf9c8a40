#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "slam/objects/object_options.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Objects of a finished run, estimated again with its dense cloud.
struct DenseObjects {
  MapSnapshotPtr map;                // with the new estimates; empty where none was taken
  std::vector<std::string> changed;  // "4 vase"

  std::string Text() const;  // one line
};

// Estimates the objects of a result again with the points of its dense.ply as further evidence (see
// slam/objects/dense_evidence.h). What each was seen in comes from the recording: the boxes of its frames,
// and its map points. Where an estimate changes, objects.json is written anew and the recording gets one more
// state. Objects that were not refined (method paper, other representations) stay as they are. Throws
// InputError.
DenseObjects RefineObjectsWithCloud(const std::filesystem::path& result, const ObjectOptions& options);

}  // namespace sqslam
