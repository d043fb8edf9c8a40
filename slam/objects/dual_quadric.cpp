#include "slam/objects/dual_quadric.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "slam/geometry/eigen_system.h"
#include "slam/geometry/ray.h"
#include "slam/objects/dual_conic.h"
#include "slam/objects/edge_noise.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/visibility.h"
#include "slam/util/statistics.h"

namespace sqslam {
namespace {

using conic::Bounds;

// A view in the frame of the estimation, which is centred at the object and scaled to its size.
struct ConditionedView {
  Eigen::Matrix3d R_camera_map;
  Eigen::Vector3d t_camera_map;
  Bounds box;
  std::array<EdgeKind, 4> kinds;
  std::array<double, 4> factors;  // 1 / sigma of each edge, in normalised coordinates
};

// Layout of the parameter block.
enum Parameter { kCentre = 0, kTurn = 3, kLogHalf = 6, kParameterCount = 9 };

// Residual of one box edge against the same edge of the box of the visible part.
struct BoxEdgeCost {
  const ConditionedView* view;
  Eigen::Matrix3d R_map_start;  // the ellipsoid's axes, before they are turned by the rotation vector
  Bounds image;
  int edge;

  template <typename T>
  bool operator()(const T* parameters, T* residual) const {
    using std::exp;
    const T back[3] = {-parameters[kTurn], -parameters[kTurn + 1], -parameters[kTurn + 2]};
    std::array<std::array<T, 3>, 3> axes;
    std::array<T, 3> centre;
    for (int i = 0; i < 3; ++i) {
      const auto& row = view->R_camera_map.row(i);
      const T in_map[3] = {T(row[0]), T(row[1]), T(row[2])};
      T turned[3];
      ceres::AngleAxisRotatePoint(back, in_map, turned);
      centre[i] = T(view->t_camera_map[i]);
      for (int k = 0; k < 3; ++k) {
        centre[i] += row[k] * parameters[kCentre + k];
        axes[i][k] =
            exp(parameters[kLogHalf + k]) *
            (R_map_start(0, k) * turned[0] + R_map_start(1, k) * turned[1] + R_map_start(2, k) * turned[2]);
      }
    }
    std::array<T, 4> bounds;
    if (!(centre[2] > 0.0) || !conic::VisibleBounds(conic::DualConic(axes, centre), image, bounds)) {
      return false;
    }
    residual[0] = view->factors[edge] * (bounds[edge] - view->box[edge]);
    return true;
  }
};

// Priors on the parameters, for a start that is upright.
struct PriorCost {
  QuadricPriors priors;  // in the frame of the parameters

  template <typename T>
  bool operator()(const T* parameters, T* residuals) const {
    using std::exp;
    constexpr double kUpright = 0.02;  // rad
    constexpr double kContact = 0.02;  // half diagonals of the box
    constexpr double kFixed = 0.002;   // rad
    const T* log_half = parameters + kLogHalf;
    residuals[0] = parameters[kTurn] / kUpright;
    residuals[1] = parameters[kTurn + 1] / kUpright;
    residuals[2] = priors.keeps_yaw ? parameters[kTurn + 2] / kFixed : T(0.0);
    residuals[3] = (log_half[0] - log_half[1] - priors.log_width_ratio) / priors.width_sigma;
    residuals[4] =
        (log_half[2] - 0.5 * (log_half[0] + log_half[1]) - priors.log_height_ratio) / priors.height_sigma;
    residuals[5] = (parameters[kCentre + 2] - exp(log_half[2]) - priors.support) / kContact;
    return true;
  }
};

bool IsBeforeCamera(const PosedSuperquadric& ellipsoid, const ConditionedView& view) {
  const Eigen::Vector3d centre = view.R_camera_map * ellipsoid.T_map_object.translation + view.t_camera_map;
  const Eigen::Vector3d forward =
      ellipsoid.T_map_object.RotationMatrix().transpose() * view.R_camera_map.row(2).transpose();
  return centre.z() > ellipsoid.shape.half_size.cwiseProduct(forward).norm();
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

std::vector<ConditionedView> ConditionedViews(std::span<const BoxView> views, const Camera& camera,
                                              const Sim3d& S_map_frame, const ObjectOptions& options) {
  std::vector<ConditionedView> conditioned;
  for (const BoxView& view : views) {
    const Box2d box = UndistortBox(view.box, camera);
    const Rigid3d T_camera_map = view.T_map_camera.Inverse();
    ConditionedView out;
    out.R_camera_map = T_camera_map.RotationMatrix();
    out.t_camera_map = (T_camera_map * S_map_frame.translation) / S_map_frame.scale;
    out.box = NormalisedBounds(box, camera);
    out.kinds = EdgesOf(view, camera, options.detections).kinds;
    for (std::size_t edge = 0; edge < 4; ++edge) {
      const bool vertical = edge % 2 == 1;
      const double sigma = EdgeSigma(vertical ? box.height : box.width, options.refinement);
      out.factors[edge] = (vertical ? camera.fy : camera.fx) / sigma;
    }
    conditioned.push_back(out);
  }
  return conditioned;
}

// Step 1: linear least squares over all free edges. The scale of Q* is fixed by its last entry, -1 for every
// ellipsoid; each residual is then the difference between the squared distances of the edge's plane and of
// the parallel tangent plane from the centre. (With the norm fixed instead, a little noise drives the
// solution to hyperboloids.) Empty if the planes do not determine the quadric.
std::optional<Eigen::Matrix4d> LinearDualQuadric(const std::vector<ConditionedView>& views) {
  constexpr int kUnknowns = 9;  // of a symmetric 4x4 matrix without its last entry
  constexpr double kLeastRank = 1e-4;
  std::vector<Eigen::Vector4d> planes;
  for (const ConditionedView& view : views) {
    for (int edge = 0; edge < 4; ++edge) {
      if (view.kinds[edge] != EdgeKind::kFree) {
        continue;
      }
      Eigen::Vector3d line = Eigen::Vector3d::Unit(edge % 2);
      line.z() = -view.box[edge];
      Eigen::Vector4d plane;
      plane << view.R_camera_map.transpose() * line, line.dot(view.t_camera_map);
      planes.push_back(plane / plane.head<3>().norm());
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

Bounds WholeImage(const Camera& camera) {
  const Box2d image{0.0, 0.0, static_cast<double>(camera.width), static_cast<double>(camera.height)};
  return NormalisedBounds(UndistortBox(image, camera), camera);
}

// Step 2: refines by the boxes of the visible parts. Empty unless the result is bounded and before the
// cameras.
std::optional<PosedSuperquadric> RefineByBoxes(const PosedSuperquadric& start,
                                               const std::vector<ConditionedView>& views, const Bounds& image,
                                               const RefinementOptions& options,
                                               const std::optional<QuadricPriors>& priors) {
  constexpr double kLargest = 20.0;   // half axis, in half diagonals of the boxes
  constexpr double kThinnest = 1e-3;  // the same; a result this thin is a disc
  std::array<double, kParameterCount> parameters{};
  for (int i = 0; i < 3; ++i) {
    parameters[kCentre + i] = start.T_map_object.translation[i];
    parameters[kLogHalf + i] = std::log(std::clamp(start.shape.half_size[i], 2.0 * kThinnest, kLargest));
  }
  const Eigen::Matrix3d R_map_start = start.T_map_object.RotationMatrix();
  ceres::Problem problem;
  for (const ConditionedView& view : views) {
    for (int edge = 0; edge < 4; ++edge) {
      if (view.kinds[edge] != EdgeKind::kHidden) {
        problem.AddResidualBlock(new ceres::AutoDiffCostFunction<BoxEdgeCost, 1, kParameterCount>(
                                     new BoxEdgeCost{&view, R_map_start, image, edge}),
                                 new ceres::CauchyLoss(2.0), parameters.data());
      }
    }
  }
  if (priors) {
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PriorCost, 6, kParameterCount>(new PriorCost{*priors}), nullptr,
        parameters.data());
  }
  for (int i = kLogHalf; i < kLogHalf + 3; ++i) {
    problem.SetParameterLowerBound(parameters.data(), i, std::log(kThinnest));
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.max_num_iterations = 3 * options.max_iterations;
  solver.function_tolerance = 1e-8;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);

  PosedSuperquadric result;
  result.shape = {Eigen::Map<const Eigen::Vector3d>(parameters.data() + kLogHalf).array().exp().matrix(), 1.0,
                  1.0};
  const Eigen::Vector3d turn = Eigen::Map<const Eigen::Vector3d>(parameters.data() + kTurn);
  const Eigen::AngleAxisd turned(turn.norm(),
                                 turn.norm() > 0.0 ? turn.normalized() : Eigen::Vector3d::UnitX());
  result.T_map_object.rotation = Eigen::Quaterniond(turned) * Eigen::Quaterniond(R_map_start);
  result.T_map_object.translation = Eigen::Map<const Eigen::Vector3d>(parameters.data() + kCentre);
  const bool bounded =
      summary.IsSolutionUsable() && result.shape.half_size.maxCoeff() < kLargest &&
      result.shape.half_size.minCoeff() > 1.01 * kThinnest &&
      std::ranges::all_of(views, [&](const ConditionedView& view) { return IsBeforeCamera(result, view); });
  return bounded ? std::optional(result) : std::nullopt;
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
                                                   const std::optional<QuadricPriors>& priors) {
  const Sim3d S_map_frame{start.shape.half_size.norm(), Eigen::Quaterniond::Identity(),
                          start.T_map_object.translation};
  std::optional<QuadricPriors> in_frame = priors;
  if (in_frame) {
    in_frame->support = (priors->support - S_map_frame.translation.z()) / S_map_frame.scale;
  }
  const std::optional<PosedSuperquadric> refined =
      RefineByBoxes(S_map_frame.Inverse() * start, ConditionedViews(views, camera, S_map_frame, options),
                    WholeImage(camera), options.refinement, in_frame);
  return refined ? std::optional(S_map_frame * *refined) : std::nullopt;
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
  const std::vector<ConditionedView> conditioned = ConditionedViews(views, camera, *S_map_frame, options);
  const std::optional<Eigen::Matrix4d> linear = LinearDualQuadric(conditioned);
  const std::optional<PosedSuperquadric> start = linear ? EllipsoidOf(*linear) : std::nullopt;
  if (!start || !std::ranges::all_of(
                    conditioned, [&](const ConditionedView& view) { return IsBeforeCamera(*start, view); })) {
    return std::nullopt;
  }
  std::optional<PosedSuperquadric> refined =
      RefineByBoxes(*start, conditioned, WholeImage(camera), options.refinement, std::nullopt);
  if (refined) {
    refined = EllipsoidOf(DualQuadricOf(*refined));
  }
  if (refined) {
    refined = *S_map_frame * *refined;
  }
  return refined;
}

}  // namespace sqslam
