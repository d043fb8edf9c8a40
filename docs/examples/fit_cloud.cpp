// Fits superquadrics to all objects of a cloud: fit_cloud CLOUD

#include <iostream>

#include "slam/fitting/fitting.h"
#include "slam/geometry/solid_iou.h"
#include "slam/io/point_cloud.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: fit_cloud CLOUD\n";
    return 2;
  }
  try {
    const sqslam::PointCloud cloud = sqslam::ReadPointCloud(argv[1]);  // .ply, or text with x y z
    sqslam::MultiFitOptions options;
    options.clusters = 0;        // all objects
    options.fit.upright = true;  // standing objects: only yaw is free
    for (const sqslam::SuperquadricFit& fit : sqslam::FitSuperquadrics(cloud.points, options)) {
      const auto& [shape, T_cloud_object] = fit.superquadric;
      std::cout << "half size " << shape.half_size.transpose() << ", exponents " << shape.e1 << ' '
                << shape.e2 << ", at " << T_cloud_object.translation.transpose() << ", rms " << fit.rms
                << '\n';
      const sqslam::Solid box{sqslam::SolidKind::kCuboid, shape.half_size, 0.1, 0.1, T_cloud_object};
      std::cout << "  as a box it would overlap by "
                << IoU(box, sqslam::Solid::FromSuperquadric(fit.superquadric)) << '\n';
    }
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
