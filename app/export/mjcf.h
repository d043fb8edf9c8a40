#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "slam/scene/scene_graph.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::app {

// Summary for the user of what a simulator's scene took over.
struct MjcfSummary {
  int free = 0;                      // bodies that can move
  int fixed = 0;                     // furniture, and things whose support is not known
  std::vector<std::string> notes{};  // what could not be resolved within the covariances, one line each
};

// Writes a scene for MuJoCo (MJCF, from version 2.2 on) with z up and gravity down, and convex meshes as .obj
// in a folder beside it, named like it, if any object needs one. Reliable objects only:
//   box, cylinder, ellipsoid  exactly, where the exponents are those within two standard deviations;
//                             otherwise a mesh
//   parts                     each of them, where they are known, except for a seat on which something lies
//   class with legs           its top and four legs; a seat: the part below what lies on it
//   free bodies               things that stand on something; the rest is fixed. A thing in another belongs
//                             to it
//   floor, surfaces           a plane; boxes under the objects on them
//   cameras                   of up to 50 keyframes
// Objects stand where Settle() moves them; masses and friction are those of the class. `graph`: of `map`.
// Throws InputError if the map has no objects, no scale or no gravity, or if a file cannot be written.
MjcfSummary WriteMjcf(const std::filesystem::path& path, const MapSnapshot& map, const SceneGraph& graph);

}  // namespace sqslam::app
