#include "slam/estimation/bundle_objects.h"

#include <ceres/loss_function.h>

#include <algorithm>

#include "slam/estimation/bundle_problem.h"

namespace sqslam {

void AddObjects(std::span<const ObjectTerm> objects, const JointObjectOptions& options, const Map& map,
                BundleProblem& problem) {
  for (const ObjectTerm& term : objects) {
    BundleObject object;
    object.id = term.id;
    object.superquadric = term.superquadric;
    object.sigma = options.sigma * term.superquadric.shape.half_size.mean();
    object.huber = options.huber;
    object.prior = options.prior;
    for (std::size_t i = 0; i < term.points.size(); ++i) {
      const PointId id = term.points[i];
      const auto it = std::lower_bound(problem.points.begin(), problem.points.end(), id,
                                       [](const BundlePoint& a, PointId b) { return a.id < b; });
      if (it != problem.points.end() && it->id == id) {
        object.points.push_back({static_cast<std::size_t>(it - problem.points.begin()), term.weights[i]});
      } else {
        object.held_points.push_back({map.Point(id).p_map, term.weights[i]});
      }
    }
    if (static_cast<int>(object.points.size()) >= options.min_points) {
      problem.objects.push_back(std::move(object));
    }
  }
}

double ShapeCost(const BundleObject& object, const BundleProblem& problem) {
  const Rigid3d T_object_map = object.superquadric.T_map_object.Inverse();
  const ceres::HuberLoss huber(object.huber);
  double sum = 0.0;
  const auto add = [&](const Eigen::Vector3d& p_map, double weight) {
    const double distance = object.superquadric.shape.RadialDistance(T_object_map * p_map) / object.sigma;
    double rho[3];
    huber.Evaluate(weight * distance * distance, rho);
    sum += rho[0];
  };
  for (const BundleObject::Point& point : object.points) {
    if (problem.points[point.index].alive) {
      add(problem.points[point.index].p_map, point.weight);
    }
  }
  for (const BundleObject::HeldPoint& point : object.held_points) {
    add(point.p_map, point.weight);
  }
  return sum;
}

}  // namespace sqslam
