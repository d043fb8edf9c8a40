#include "slam/geometry/nearest_solid.h"

#include <cmath>
#include <numbers>
#include <vector>

namespace sqslam {
namespace {

// Directions of equal weight, and the radius of a superquadric along each.
struct Radii {
  std::vector<Eigen::Vector3d> directions;  // spread over half a sphere, in units of the half sizes
  std::vector<double> radii;
};

// Both solids are star-shaped about one centre, so the volume of their intersection is the mean cubed smaller
// radius over all directions; ratios of volumes are the same in units of the half sizes.
Radii RadiiOf(const Superquadric& shape) {
  constexpr int kDirections = 400;
  Radii radii;
  for (int i = 0; i < kDirections; ++i) {  // Fibonacci spiral
    const double z = (i + 0.5) / kDirections;
    const double angle = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double across = std::sqrt(1.0 - z * z);
    radii.directions.push_back(
        shape.half_size.cwiseProduct(Eigen::Vector3d(across * std::cos(angle), across * std::sin(angle), z)));
    radii.radii.push_back(1.0 / shape.RadialScale(radii.directions.back()));
  }
  return radii;
}

double IoU(const Radii& truth, const Solid& solid) {
  const Eigen::Quaterniond R_solid_object = solid.T_map_object.rotation.conjugate();
  double shared = 0.0;
  double joint = 0.0;
  for (std::size_t i = 0; i < truth.radii.size(); ++i) {
    const double radius = 1.0 / solid.RadialScale(R_solid_object * truth.directions[i]);
    shared += std::pow(std::min(radius, truth.radii[i]), 3);
    joint += std::pow(std::max(radius, truth.radii[i]), 3);
  }
  return shared / joint;
}

// Maximises the IoU by coordinate search over the half sizes with decreasing steps; returns the IoU.
double MaximizeIoU(const Radii& truth, Solid& solid) {
  double best = IoU(truth, solid);
  for (double step = 0.3; step > 0.002; step *= 0.5) {
    for (bool better = true; better;) {
      better = false;
      for (int i = 0; i < 6; ++i) {
        Solid changed = solid;
        changed.half_size[i / 2] *= std::exp(i % 2 == 0 ? step : -step);
        const double iou = IoU(truth, changed);
        if (iou > best) {
          best = iou;
          solid = changed;
          better = true;
        }
      }
    }
  }
  return best;
}

}  // namespace

PosedSuperquadric NearestOfKind(SolidKind kind, const PosedSuperquadric& superquadric) {
  constexpr double kMinGain = 0.03;
  if (kind == SolidKind::kSuperquadric) {
    return superquadric;
  }
  const Radii truth = RadiiOf(superquadric.shape);
  Solid best{kind, superquadric.shape.half_size, 1.0, 1.0, {}};  // in the object's frame
  const double straight = MaximizeIoU(truth, best);
  if (kind == SolidKind::kCuboid && superquadric.shape.e2 > 1.0) {
    Solid turned = best;
    turned.half_size.head<2>().setConstant(best.half_size.head<2>().mean());
    turned.T_map_object.rotation = Eigen::AngleAxisd(std::numbers::pi / 4.0, Eigen::Vector3d::UnitZ());
    if (MaximizeIoU(truth, turned) > straight + kMinGain) {
      best = turned;
    }
  }
  PosedSuperquadric nearest{{best.half_size, 1.0, 1.0}, superquadric.T_map_object * best.T_map_object};
  SetExponents(kind, nearest.shape.e1, nearest.shape.e2);
  return nearest;
}

}  // namespace sqslam
