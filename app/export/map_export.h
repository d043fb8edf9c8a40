#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "render/scene/cloud_layer.h"
#include "render/surface/surface_mesh.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::app {

// A map as a binary glTF 2.0 file for 3D programs, y up as glTF demands: the root node turns the map's z axis
// there, everything below it is in the map frame and its units. Nodes:
//   map
//     objects      one node "ID label" an object: mesh in the object's own frame, pose in the node, material
//                  in the colour of the class, and as extras id, label, score, observations, points,
//                  half_size, e1, e2 and yaw
//     points       POINTS with the colours of the images
//     surface      TRIANGLES with colours
//     trajectory   LINE_STRIP through the camera's centres: `trajectory`, or the keyframes where that is
//     empty keyframes    one camera node a keyframe with the calibration's view angles, and LINES for all
//     frusta
//     flight       a camera that flies along the path
// An animation of the run's own length moves the flight and gives each object its size when it was first
// seen. Names are unique, and no longer than Blender keeps them. A group without content is left out.
// `first_seen`: time of each object's first sight, by id, seconds; `generator`: name and version of the
// program.
std::string MapGlb(const MapSnapshot& map, const Trajectory& trajectory, const SurfaceMesh& surface,
                   const std::map<std::int32_t, double>& first_seen, const std::string& generator);

// The objects, of so many steps of longitude, the points, and those of a dense cloud as "cloud": what the
// page of a map draws.
std::string ViewGlb(const MapSnapshot& map, const std::vector<CloudPoint>& cloud, int segments,
                    const std::string& generator);

// The surface alone.
std::string SurfaceGlb(const MapSnapshot& map, const SurfaceMesh& surface, const std::string& generator);

// Superquadrics as meshes in the map frame: quads of Eq. 1 on a regular grid, with normals, in the colours of
// their classes. By extension: .obj (one named object each, with the colours as materials in a .mtl file
// beside it) or .ply (ascii, all objects in one mesh). Throws UsageError for another one.
void WriteObjectMeshes(const std::filesystem::path& path, const std::vector<SnapshotObject>& objects);

}  // namespace sqslam::app
