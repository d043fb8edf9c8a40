#include "slam/objects/dual_quadric.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "slam/geometry/eigen_system.h"
#include "slam/geometry/ray.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/object_energy.h"
#include "slam/util/statistics.h"

namespace sqslam {
namespace {

bool IsBeforeCameras(const PosedSuperquadric& ellipsoid, std::span<const BoxView> views,
                     const Camera& camera) {
  return std::ranges::all_of(views, [&](const BoxView& view) {
    return ProjectToBox(ellipsoid, view.T_map_camera, camera).has_value();
  });
}

// Returns the point nearest to the rays through the box centres; empty if these are nearly parallel.
std::optional<Eigen::Vector3d> PlaceOf(std::span<const BoxView> views, const Camera& camera) {
  constexpr double kLeastSpread = 1e-6;  // sin^2 of the angle between the rays
  RaySum rays;
  for (const BoxView& view : views) {
    const Eigen::Vector2d pixel = UndistortBox(view.box, camera).Center();
    rays.Add(
        {view.T_map_camera.translation, (view.T_map_camera.rotation * camera.Unproject(pixel)).normalized()});
  }
  if (EigenSystemOf(rays.information).values[0] < kLeastSpread * static_cast<double>(views.size())) {
    return std::nullopt;
  }
  return rays.Nearest();
}

// Returns the energy of the box edges alone, in a frame that is centred at the object and scaled to its size.
// As in QuadricSLAM the detector has no bias, and overshooting an edge costs as much as falling short of it.
ObjectEnergy EnergyOfBoxes(std::span<const BoxView> views, const Camera& camera, const Sim3d& S_map_frame,
                           const RefinementOptions& options) {
  ObjectEnergy energy;
  energy.variant.leaning = true;
  for (const BoxView& view : views) {
    energy.AddEdges(
        {S_map_frame.Inverse() * view.T_map_camera, UndistortBox(view.box, camera), view.edge_free}, camera,
        options);
  }
  for (EdgeTerm& edge : energy.edges) {
    edge.size = 0.0;
    edge.symmetric = true;
  }
  return energy;
}

// Adds the priors of an upright ellipsoid in its own frame, whose unit is `size` and whose origin is at
// `height`, map units.
void AddPriors(const QuadricPriors& priors, double height, double size, ObjectEnergy& energy) {
  constexpr double kUpright = 0.02;  // rad
  constexpr double kContact = 0.02;  // of the size
  constexpr double kYaw = 0.002;     // rad
  energy.AddProportions(priors.known);
  energy.contacts.push_back({(priors.support - height) / size, 1.0 / kContact, true, -1.0});
  energy.normals.push_back({parameter::kTilt, 1.0 / kUpright, 1.0 / kUpright});
  energy.normals.push_back({parameter::kTilt + 1, 1.0 / kUpright, 1.0 / kUpright});
  energy.normals.push_back({parameter::kYaw, 1.0 / kYaw, 1.0 / kYaw});
}

// Step 1: linear least squares over all free edges. The scale of Q* is fixed by its last entry, -1 for every
// ellipsoid; each residual is then the difference between the squared distances of the edge's plane and of
// the parallel tangent plane from the centre. (With the norm fixed instead, a little noise drives the
// solution to hyperboloids.) Empty if the planes do not determine the quadric.
std::optional<Eigen::Matrix4d> LinearDualQuadric(const std::vector<EdgeTerm>& edges) {
  constexpr int kUnknowns = 9;  // of a symmetric 4x4 matrix without its last entry
  constexpr double kLeastRank = 1e-4;
  std::vector<Eigen::Vector4d> planes;
  for (const EdgeTerm& edge : edges) {
    if (edge.exact) {
      planes.emplace_back();
      planes.back() << edge.normal_map, -edge.normal_map.dot(edge.camera_centre);
      planes.back() /= edge.normal_map.norm();
    }
  }
  if (planes.size() < kUnknowns) {
    return std::nullopt;
  }
  cv::Mat_<double> A(static_cast<int>(planes.size()), kUnknowns);
  cv::Mat_<double> b(A.rows, 1);
  for (int row = 0; row < A.rows; ++row) {
    const Eigen::Vector4d& plane = planes[static_cast<std::size_t>(row)];
    int column = 0;
    for (int i = 0; i < 3; ++i) {
      for (int j = i; j < 4; ++j) {
        A(row, column++) = (i == j ? 1.0 : 2.0) * plane[i] * plane[j];
      }
    }
    b(row) = plane[3] * plane[3];
  }
  const cv::SVD svd(A);
  if (svd.w.at<double>(kUnknowns - 1) < kLeastRank * svd.w.at<double>(0)) {
    return std::nullopt;
  }
  cv::Mat_<double> q;
  svd.backSubst(b, q);
  Eigen::Matrix4d quadric = Eigen::Matrix4d::Zero();
  int column = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 4; ++j) {
      quadric(i, j) = quadric(j, i) = q(column++);
    }
  }
  quadric(3, 3) = -1.0;
  return quadric;
}

// Step 2: refines `start` in its own frame, in units of `size`. Empty unless the result is bounded and before
// the cameras.
std::optional<PosedSuperquadric> RefineByBoxes(const PosedSuperquadric& start, double size,
                                               std::span<const BoxView> views, const Camera& camera,
                                               const RefinementOptions& options,
                                               const std::optional<QuadricPriors>& priors) {
  constexpr double kLargest = 20.0;   // half axis, in units of `size`
  constexpr double kThinnest = 1e-3;  // the same; a result this thin is a disc
  const Sim3d S_map_frame{size, start.T_map_object.rotation, start.T_map_object.translation};
  ObjectEnergy energy = EnergyOfBoxes(views, camera, S_map_frame, options);
  if (priors) {
    AddPriors(*priors, S_map_frame.translation.z(), size, energy);
  }
  AllParameters x = AllParameters::Zero();
  x.segment<3>(parameter::kLogHalf) =
      (start.shape.half_size / size).cwiseMax(2.0 * kThinnest).cwiseMin(kLargest).array().log();
  Minimise(energy, 3 * options.max_iterations, 1e-8, x);
  const ObjectSolid<double> solid(x.data(), energy.variant);
  Eigen::Matrix3d R_object_frame;
  for (int axis = 0; axis < 3; ++axis) {
    R_object_frame.col(axis) = solid.ToObject(Eigen::Vector3d::Unit(axis));
  }
  const PosedSuperquadric result =
      S_map_frame * PosedSuperquadric{{solid.hull, 1.0, 1.0},
                                      {Eigen::Quaterniond(R_object_frame.transpose()), solid.centre}};
  const bool bounded = solid.hull.maxCoeff() < kLargest && solid.hull.minCoeff() > kThinnest;
  return bounded && IsBeforeCameras(result, views, camera) ? std::optional(result) : std::nullopt;
}

}  // namespace

std::optional<Sim3d> FrameOfBoxes(std::span<const BoxView> views, const Camera& camera) {
  const std::optional<Eigen::Vector3d> place = PlaceOf(views, camera);
  if (!place) {
    return std::nullopt;
  }
  std::vector<double> sizes;
  for (const BoxView& view : views) {
    const double depth = (view.T_map_camera.Inverse() * *place).z();
    if (depth <= 0.0) {
      return std::nullopt;
    }
    const Box2d box = UndistortBox(view.box, camera);
    sizes.push_back(0.5 * depth * std::hypot(box.width / camera.fx, box.height / camera.fy));
  }
  const double size = UpperMedian(std::move(sizes));
  return size > 0.0 ? std::optional(Sim3d{size, Eigen::Quaterniond::Identity(), *place}) : std::nullopt;
}

Eigen::Matrix4d DualQuadricOf(const PosedSuperquadric& ellipsoid) {
  Eigen::Vector4d diagonal;
  diagonal << ellipsoid.shape.half_size.cwiseAbs2(), -1.0;
  const Eigen::Matrix4d Z = ellipsoid.T_map_object.Matrix();
  return Z * diagonal.asDiagonal() * Z.transpose();
}

std::optional<PosedSuperquadric> EllipsoidOf(const Eigen::Matrix4d& dual_quadric) {
  const double last = dual_quadric(3, 3);
  if (std::abs(last) <= 1e-12 * dual_quadric.cwiseAbs().maxCoeff()) {
    return std::nullopt;
  }
  const Eigen::Matrix4d Q = dual_quadric / -last;
  const Eigen::Vector3d centre = -Q.topRightCorner<3, 1>();
  const Eigen::Matrix3d squares = Q.topLeftCorner<3, 3>() + centre * centre.transpose();
  const EigenSystem<3> eigen = EigenSystemOf(squares);
  if (!squares.allFinite() || !(eigen.values[0] > 0.0)) {
    return std::nullopt;
  }
  const Eigen::Matrix3d axes = eigen.vectors;
  Eigen::Index z = 0;
  axes.row(2).cwiseAbs().maxCoeff(&z);
  const Eigen::Index first = (z + 1) % 3;
  const Eigen::Index second = (z + 2) % 3;
  const Eigen::Index x = std::abs(axes(0, first)) >= std::abs(axes(0, second)) ? first : second;
  const Eigen::Index y = 3 - x - z;
  Eigen::Matrix3d R;
  R.col(0) = std::copysign(1.0, axes(0, x)) * axes.col(x);
  R.col(2) = std::copysign(1.0, axes(2, z)) * axes.col(z);
  R.col(1) = R.col(2).cross(R.col(0));
  PosedSuperquadric ellipsoid;
  ellipsoid.shape.half_size = Eigen::Vector3d(eigen.values[x], eigen.values[y], eigen.values[z]).cwiseSqrt();
  ellipsoid.T_map_object = {Eigen::Quaterniond(R), centre};
  return ellipsoid;
}

std::optional<PosedSuperquadric> RefineDualQuadric(const PosedSuperquadric& start,
                                                   std::span<const BoxView> views, const Camera& camera,
                                                   const ObjectOptions& options,
                                                   const QuadricPriors& priors) {
  return RefineByBoxes(start, start.shape.half_size.norm(), views, camera, options.refinement, priors);
}

std::optional<PosedSuperquadric> EstimateDualQuadric(std::span<const BoxView> views, const Camera& camera,
                                                     const ObjectOptions& options) {
  constexpr std::size_t kLeastViews = 3;
  if (views.size() < kLeastViews) {
    return std::nullopt;
  }
  const std::optional<Sim3d> S_map_frame = FrameOfBoxes(views, camera);
  if (!S_map_frame) {
    return std::nullopt;
  }
  const std::optional<Eigen::Matrix4d> linear =
      LinearDualQuadric(EnergyOfBoxes(views, camera, *S_map_frame, options.refinement).edges);
  std::optional<PosedSuperquadric> ellipsoid = linear ? EllipsoidOf(*linear) : std::nullopt;
  if (ellipsoid) {
    ellipsoid = *S_map_frame * *ellipsoid;
  }
  if (!ellipsoid || !IsBeforeCameras(*ellipsoid, views, camera)) {
    return std::nullopt;
  }
  ellipsoid = RefineByBoxes(*ellipsoid, S_map_frame->scale, views, camera, options.refinement, std::nullopt);
  return ellipsoid ? EllipsoidOf(DualQuadricOf(*ellipsoid)) : std::nullopt;
}

}  // namespace sqslam
