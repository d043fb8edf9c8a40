#pragma once

#include <filesystem>
#include <vector>

#include "slam/snapshot/snapshot.h"

namespace sqslam::app {

// Superquadrics as meshes in the map frame: quads of Eq. 1 on a regular grid, with normals, in the colours of
// their classes. By extension: .obj (one named object each, with the colours as materials in a .mtl file
// beside it) or .ply (ascii, all objects in one mesh). Throws UsageError for another one.
void WriteObjectMeshes(const std::filesystem::path& path, const std::vector<SnapshotObject>& objects);

}  // namespace sqslam::app
