#pragma once

#include <Eigen/Core>
#include <string>

// The light that maps are seen in: a bright room with one large lamp and a window opposite.
namespace sqslam {

// Directions of the room, map frame, unit length.
struct Studio {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d front = -Eigen::Vector3d::UnitY();  // level, where one usually looks from

  Eigen::Vector3d Right() const { return up.cross(front); }
  Eigen::Vector3d Lamp() const;    // towards it: from above, the left and a little from the front
  Eigen::Vector3d Window() const;  // from the other side, a little above the horizon
};

// Light that arrives from a direction with these cosines to up, lamp and window; linear red, green, blue.
// White of a surface that faces the lamp is about 1.
Eigen::Vector3d StudioRadiance(double up, double lamp, double window);

// Light that falls on a surface with these cosines of its normal, divided by pi: the radiance convolved with
// the cosine, which zonal harmonics to degree 2 give to about 1 % (Ramamoorthi and Hanrahan, 2001).
Eigen::Vector3d StudioIrradiance(double up, double lamp, double window);

// GLSL functions `vec3 studioIrradiance(vec3 cosines)` and `vec3 studioReflection(vec3 cosines, float
// roughness)` with the numbers of the above; what is reflected is blurred as roughness asks.
std::string StudioShader();

}  // namespace sqslam
