#pragma once

#include <vtkSmartPointer.h>
#include <vtkTexture.h>

#include <Eigen/Core>

// The light that maps are seen in: a bright room with one large lamp. For the sources of render/ only.
namespace sqslam {

// Directions of the room, map frame, unit length.
struct Studio {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d front = -Eigen::Vector3d::UnitY();  // level, where one usually looks from

  Eigen::Vector3d Right() const { return up.cross(front); }
  Eigen::Vector3d Lamp() const;  // towards it: from above, the left and a little from the front
};

// What surfaces reflect, as an equirectangular picture of radiance (linear): its middle lies at Right() as
// VTK's renderer wants it with EnvironmentUp and EnvironmentRight set to Up and Right().
vtkSmartPointer<vtkTexture> StudioRoom(const Studio& studio);

}  // namespace sqslam
