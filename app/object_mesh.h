#pragma once

#include <filesystem>
#include <vector>

#include "slam/map/snapshot.h"

namespace sqslam::app {

// Superquadrics as meshes in the map frame: quads of Eq. 1 on a regular grid, with normals. By extension:
// .obj (one named group for each object) or .ply (ascii, all objects in one mesh). Throws UsageError for
// another one.
void WriteObjectMeshes(const std::filesystem::path& path, const std::vector<SnapshotObject>& objects);

}  // namespace sqslam::app
