#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "render/solids/tessellation.h"
#include "render/synthetic/scene_description.h"

namespace sqslam {

// Light that arrives at points of a scene: lamps and windows with soft shadows, and ambient light that fades
// near other bodies. It depends on the place only and not on the camera, so it is computed once for a scene,
// and what a tracker sees on a surface stays there.
class SceneLighting {
 public:
  // Keeps a reference: the scene must outlive it.
  explicit SceneLighting(const SceneDescription& scene);

  // Irradiance (RGB, relative; about 1 where it is bright) at a point with unit normal, both in the world
  // frame.
  Eigen::Vector3d IrradianceAt(const Eigen::Vector3d& p_world, const Eigen::Vector3d& normal) const;

 private:
  struct Occluder {
    Superquadric shape;
    Rigid3d T_object_world;
    Eigen::Vector3d center;  // of a sphere around the body, world frame
    double radius2;          // squared radius of that sphere
  };

  bool Blocked(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

  const SceneDescription& scene_;
  std::vector<Occluder> occluders_;
};

// A mesh with its picture and its light, ready to be drawn without any further shading.
struct TexturedMesh : TriangleMesh {                 // in the world frame
  std::int32_t id = 0;                               // of the object, 0 for what has no ground truth
  std::vector<Eigen::Vector2f> texture_coordinates;  // [0, 1]; v = 0 at the last row of the picture
  std::vector<std::array<std::uint8_t, 3>> light;    // RGB, multiplies the texture
  cv::Mat texture;                                   // 8UC3, BGR
};

// Paints a picture of `width` x `height` metres at `pixels_per_metre`. Every pattern has detail at all scales
// down to two pixels and repeats nowhere, so that corners are found and told apart. Patterns: package, book,
// ceramic, marble, wood, plaster, terrazzo, poster, page. `variation` makes another picture of the same kind,
// for another side of one body. Deterministic in its arguments. Throws InputError on an unknown pattern.
// Returns 8UC3, BGR.
cv::Mat PaintTexture(const TextureDescription& texture, double width, double height, double pixels_per_metre,
                     int variation);

// A superquadric as three charts: the side unrolled as a label is around a can, and both caps seen from above
// and below. Each chart keeps lengths nearly true, so nothing is stretched.
std::vector<TexturedMesh> BuildBody(const SceneBody& body, const SceneLighting& lighting);

TexturedMesh BuildPanel(const ScenePanel& panel, const SceneLighting& lighting);

}  // namespace sqslam
