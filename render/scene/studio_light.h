#pragma once

#include <Eigen/Core>
#include <string>

// The lighting of maps: a bright room with one large lamp and a window opposite.
namespace sqslam {

// Directions of the room, map frame, unit length.
struct Studio {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d front = -Eigen::Vector3d::UnitY();  // horizontal, towards the usual viewer

  Eigen::Vector3d Right() const { return up.cross(front); }
  Eigen::Vector3d Lamp() const;    // direction towards the lamp: above, left and a little to the front
  Eigen::Vector3d Window() const;  // direction towards the window: right, a little above the horizon
};

// Returns the linear RGB radiance from a direction with these cosines to up, lamp and window. A white surface
// that faces the lamp has a brightness of about 1.
Eigen::Vector3d StudioRadiance(double up, double lamp, double window);

// Returns the irradiance / pi on a surface whose normal has these cosines: the radiance convolved with the
// cosine lobe, by zonal harmonics to degree 2, accurate to about 1 % (Ramamoorthi and Hanrahan, 2001).
Eigen::Vector3d StudioIrradiance(double up, double lamp, double window);

// Returns the GLSL functions `vec3 studioIrradiance(vec3 cosines)` and `vec3 studioReflection(vec3 cosines,
// float roughness)` for this light; reflections are blurred according to roughness.
std::string StudioShader();

}  // namespace sqslam
