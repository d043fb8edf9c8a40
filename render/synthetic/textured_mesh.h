#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "render/solids/tessellation.h"
#include "render/synthetic/scene_description.h"

namespace sqslam {

// Light at points of a scene: lamps and windows with soft shadows, and ambient light that fades near other
// bodies. It does not depend on the camera, so it is computed once per scene and surfaces keep their
// appearance for a tracker.
class SceneLighting {
 public:
  // Keeps a reference: the scene must outlive it.
  explicit SceneLighting(const SceneDescription& scene);

  // Returns the irradiance (RGB, relative; about 1 in bright places) at a point with unit normal, world
  // frame.
  Eigen::Vector3d IrradianceAt(const Eigen::Vector3d& p_world, const Eigen::Vector3d& normal) const;

 private:
  struct Occluder {
    Superquadric shape;
    Rigid3d T_object_world;
    Eigen::Vector3d center;  // of the bounding sphere, world frame
    double radius2;          // squared radius of the bounding sphere
  };

  bool Blocked(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

  const SceneDescription& scene_;
  std::vector<Occluder> occluders_;
};

// A mesh with its texture and its light, ready to be drawn without further shading.
struct TexturedMesh : TriangleMesh {                 // in the world frame
  std::int32_t id = 0;                               // of the object; 0: no ground truth
  std::vector<Eigen::Vector2f> texture_coordinates;  // [0, 1]; v = 0 at the last row of the texture
  std::vector<std::array<std::uint8_t, 3>> light;    // RGB, multiplies the texture
  cv::Mat texture;                                   // 8UC3, BGR
};

// Paints a texture (8UC3, BGR) of `width` x `height` metres at `pixels_per_metre`. Every pattern has detail
// at all scales down to two pixels and never repeats, so that corners are found and distinguished. Patterns:
// package, book, ceramic, marble, wood, plaster, terrazzo, poster, page. `variation` makes another texture of
// the same kind, for another side of a body. Deterministic. Throws InputError on an unknown pattern.
cv::Mat PaintTexture(const TextureDescription& texture, double width, double height, double pixels_per_metre,
                     int variation);

// Builds a superquadric from three charts: the side, unrolled like the label of a can, and the two caps, seen
// from above and below. Each chart nearly preserves lengths, so that textures are not stretched.
std::vector<TexturedMesh> BuildBody(const SceneBody& body, const SceneLighting& lighting);

TexturedMesh BuildPanel(const ScenePanel& panel, const SceneLighting& lighting);

}  // namespace sqslam
