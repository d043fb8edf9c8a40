#pragma once

#include <vtkActor.h>
#include <vtkPlaneCollection.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <Eigen/Core>
#include <vector>

#include "render/camera/camera_path.h"

namespace sqslam {

// A point cloud as VTK actors that draw no more points than the picture can show: the cloud is split into
// parts, and of a part that covers few pixels only every second, fourth, ... point is drawn. Small clouds are
// drawn whole. For the sources of render/ only.
class PointActors {
 public:
  // Diameter in samples of the picture. `clip`: planes that cut the points, as they are when a picture is
  // drawn.
  PointActors(double diameter, vtkPlaneCollection* clip) : diameter_(diameter), clip_(clip) {}

  // Vertices with colours.
  void Show(vtkPolyData* cloud);

  // Actors for this view; `pixels` is the height of the picture in samples.
  std::vector<vtkActor*> Arrange(const ViewCamera& camera, double pixels) const;

 private:
  struct Part {
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    Eigen::Vector3d half_size = Eigen::Vector3d::Zero();  // of the box around the points, map units
    int points = 0;
    std::vector<vtkSmartPointer<vtkActor>> levels;  // all points, half of them, a quarter, ...
  };

  double diameter_;
  vtkSmartPointer<vtkPlaneCollection> clip_;
  std::vector<Part> parts_;
};

}  // namespace sqslam
