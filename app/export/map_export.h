#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "render/scene/cloud_layer.h"
#include "render/scene/style.h"
#include "render/surface/surface_mesh.h"
#include "slam/dense/depth_fusion.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/enum_names.h"

namespace sqslam::app {

// Returns a map as a binary glTF 2.0 file for 3D programs. The root node rotates the map's z axis to glTF's y
// axis; everything below it is in the map frame and map units. Nodes:
//   map
//     objects      per object a node "ID label" with its pose: mesh in the object frame, material in the
//                  class colour; extras: id, label, score, observations, points, half_size, e1, e2, yaw
//     points       POINTS with the colours of the images
//     surface      TRIANGLES with colours
//     trajectory   LINE_STRIP through the camera centres of `trajectory`
//     keyframes    per keyframe a camera node with the calibration's view angles
//     frusta       LINES: the frusta of all keyframes
//     flight       a camera that follows the path
// An animation as long as the run moves that camera and shows each object from its first sight on. Names
// are unique and short enough for Blender. Empty groups are omitted. `first_seen`: time of each object's
// first sight, by id, seconds; `generator`: name and version of the program; `style`: colours of classes and
// cameras, size of the frusta.
std::string MapGlb(const MapSnapshot& map, const Trajectory& trajectory, const SurfaceMesh& surface,
                   const std::map<std::int32_t, double>& first_seen, const std::string& generator,
                   const SceneStyle& style = {});

// Returns a map as text of Universal Scene Description (.usda), z up, in the map frame and its unit:
//   /map/objects/LABEL_ID  a Mesh in the colour of the class, with sqslam:id, label, halfSize, shape (e1, e2)
//                          and reliability
//   /map/points            Points with the colours of the images
//   /map/trajectory        BasisCurves through the camera centres of `trajectory`
// As USD has no word for unknown units, the unit of a map without scale counts as a metre.
std::string MapUsd(const MapSnapshot& map, const Trajectory& trajectory, const std::string& generator,
                   const SceneStyle& style = {});

// Returns the geometry that the page of a map draws: objects with `segments` steps of longitude, map points,
// and the dense cloud as "cloud".
std::string ViewGlb(const MapSnapshot& map, const std::vector<CloudPoint>& cloud, int segments,
                    const std::string& generator, const SceneStyle& style = {});

// Fuses the depth maps of a densified recording (map.sqmap) into a mesh, with the options it was densified
// with. Returns nullopt if `progress` cancelled it. Throws InputError if the recording has no depth maps.
std::optional<SurfaceMesh> SurfaceOf(const std::filesystem::path& recording, int threads,
                                     const DensifyProgress& progress);

// Writes that mesh to dense.glb in the result folder; returns false, and keeps the file, if cancelled.
bool WriteSurface(const std::filesystem::path& result, int threads, const DensifyProgress& progress);

// Axis of a file that points up: that of the map, or that of programs which turn z up files wrongly.
enum class UpAxis { kY, kZ };
constexpr auto EnumNames(UpAxis) { return std::array{"y", "z"}; }

struct MeshFileOptions {
  LabelColors colors = {};
  UpAxis up = UpAxis::kZ;           // of a .obj; with y up, (x, y, z) of the map is (x, z, -y)
  std::string frame = "map frame";  // and unit, for the comment
};

// Writes superquadrics as closed meshes of quads and triangles (Eq. 1 on a regular grid, whose vertices are
// merged where they coincide) with normals, in the colours of their classes. The extension selects the
// format: .obj (one named object each, with a .mtl file of the colours beside it) or .ply (ASCII, all objects
// in one mesh). Throws UsageError on any other extension.
void WriteObjectMeshes(const std::filesystem::path& path, const std::vector<SnapshotObject>& objects,
                       const MeshFileOptions& options = {});

}  // namespace sqslam::app
