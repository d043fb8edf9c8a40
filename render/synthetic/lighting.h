#pragma once

#include <Eigen/Core>
#include <vector>

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

}  // namespace sqslam
