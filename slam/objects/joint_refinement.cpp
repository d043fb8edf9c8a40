#include "slam/objects/joint_refinement.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "slam/objects/superquadric_jet.h"

namespace sqslam {
namespace {

// Layout of the parameter block.
enum Parameter { kCentre = 0, kLogHalf = 3, kYaw = 6, kExponents = 7, kParameterCount = 9 };

using Parameters = std::array<double, kParameterCount>;

template <typename T>
void HalfSizes(const T* parameters, T* half) {
  using std::exp;
  for (int i = 0; i < 3; ++i) {
    half[i] = exp(parameters[kLogHalf + i]);
  }
}

// v in the map's axes -> in the object's axes (rotation by -yaw about z).
template <typename T>
void ToObjectAxes(const T* parameters, const T* v, T* result) {
  using std::cos;
  using std::sin;
  const T c = cos(parameters[kYaw]);
  const T s = sin(parameters[kYaw]);
  result[0] = c * v[0] + s * v[1];
  result[1] = -s * v[0] + c * v[1];
  result[2] = v[2];
}

struct EdgeCost {
  Eigen::Vector3d normal_map;     // outward normal of the edge's plane, map axes
  Eigen::Vector3d camera_centre;  // map frame
  Eigen::Vector3d forward_map;    // viewing direction, map axes
  double focal;                   // px
  double sigma;                   // px
  bool exact;                     // false: the silhouette reaches at least to the edge

  template <typename T>
  bool operator()(const T* parameters, T* residual) const {
    T half[3];
    HalfSizes(parameters, half);
    const T n_map[3] = {T(normal_map[0]), T(normal_map[1]), T(normal_map[2])};
    T n[3];
    ToObjectAxes(parameters, n_map, n);
    T offset(0.0);
    T depth(0.0);
    for (int i = 0; i < 3; ++i) {
      const T d = parameters[kCentre + i] - camera_centre[i];
      offset += normal_map[i] * d;
      depth += forward_map[i] * d;
    }
    const T reach =
        offset + jet::SupportFunction(half, parameters[kExponents], parameters[kExponents + 1], n);
    if (depth < 1e-6) {
      return false;
    }
    residual[0] = focal * reach / (depth * sigma);
    if (!exact && residual[0] > 0.0) {
      residual[0] = T(0.0);
    }
    return true;
  }
};

struct SurfaceCost {
  Eigen::Vector3d p_map;
  double factor;  // 1 / sigma, in map units

  template <typename T>
  bool operator()(const T* parameters, T* residual) const {
    T half[3];
    HalfSizes(parameters, half);
    T v[3];
    for (int i = 0; i < 3; ++i) {
      v[i] = p_map[i] - parameters[kCentre + i];
    }
    T p[3];
    ToObjectAxes(parameters, v, p);
    residual[0] = factor * jet::RadialDistance(half, parameters[kExponents], parameters[kExponents + 1], p);
    return true;
  }
};

// A place on the line of sight in front of a point: outside the object.
struct FreeSpaceCost {
  Eigen::Vector3d p_map;
  double factor;  // 1 / sigma, in map units

  template <typename T>
  bool operator()(const T* parameters, T* residual) const {
    SurfaceCost{p_map, factor}(parameters, residual);
    if (residual[0] > 0.0) {
      residual[0] = T(0.0);
    }
    return true;
  }
};

struct ContactCost {
  double height;
  double factor;
  bool exact;  // false: the object may float above

  template <typename T>
  bool operator()(const T* parameters, T* residual) const {
    using std::exp;
    residual[0] = factor * (parameters[kCentre + 2] - exp(parameters[kLogHalf + 2]) - height);
    if (!exact && residual[0] > 0.0) {
      residual[0] = T(0.0);
    }
    return true;
  }
};

// Weak knowledge: proportions are moderate, exponents lie near the prior, yaw agrees with the lines (modulo
// 90 degrees).
struct PriorCost {
  double e1;
  double e2;
  double exponent_factor;
  double yaw;
  double yaw_factor;

  template <typename T>
  bool operator()(const T* parameters, T* residual) const {
    using std::sin;
    constexpr double kLogRatioSigma = 1.5;
    residual[0] = (parameters[kLogHalf] - parameters[kLogHalf + 1]) / kLogRatioSigma;
    residual[1] = exponent_factor * (parameters[kExponents] - e1);
    residual[2] = exponent_factor * (parameters[kExponents + 1] - e2);
    residual[3] = yaw_factor * sin(4.0 * (parameters[kYaw] - yaw)) / 4.0;
    return true;
  }
};

Parameters PackParameters(const PosedSuperquadric& superquadric) {
  Parameters parameters{};
  const Eigen::Vector3d x_axis = superquadric.T_map_object.rotation * Eigen::Vector3d::UnitX();
  for (int i = 0; i < 3; ++i) {
    parameters[kCentre + i] = superquadric.T_map_object.translation[i];
    parameters[kLogHalf + i] = std::log(superquadric.shape.half_size[i]);
  }
  parameters[kYaw] = std::atan2(x_axis.y(), x_axis.x());
  parameters[kExponents] = std::clamp(superquadric.shape.e1, kMinShapeExponent, kMaxShapeExponent);
  parameters[kExponents + 1] = std::clamp(superquadric.shape.e2, kMinShapeExponent, kMaxShapeExponent);
  return parameters;
}

PosedSuperquadric UnpackParameters(const Parameters& parameters) {
  PosedSuperquadric superquadric;
  superquadric.shape.half_size =
      Eigen::Map<const Eigen::Vector3d>(parameters.data() + kLogHalf).array().exp().matrix();
  superquadric.shape.e1 = parameters[kExponents];
  superquadric.shape.e2 = parameters[kExponents + 1];
  superquadric.T_map_object.translation = Eigen::Map<const Eigen::Vector3d>(parameters.data() + kCentre);
  superquadric.T_map_object.rotation = Eigen::AngleAxisd(parameters[kYaw], Eigen::Vector3d::UnitZ());
  return superquadric;
}

void AddEdges(const SilhouetteView& view, const Camera& camera, const RefinementOptions& options,
              ceres::Problem& problem, double* parameters) {
  const Eigen::Matrix3d R = view.T_map_camera.RotationMatrix();
  const Box2d& box = view.box;
  const std::array<double, 4> at = {(box.x - camera.cx) / camera.fx, (box.y - camera.cy) / camera.fy,
                                    (box.x + box.width - camera.cx) / camera.fx,
                                    (box.y + box.height - camera.cy) / camera.fy};
  for (int edge = 0; edge < 4; ++edge) {
    const int axis = edge % 2;
    const double outward = edge < 2 ? -1.0 : 1.0;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    normal[axis] = outward;
    normal[2] = -outward * at[edge];
    const double sigma =
        options.edge_sigma_px + options.edge_sigma_share * (axis == 0 ? box.width : box.height);
    auto* cost =
        new EdgeCost{R * normal, view.T_map_camera.translation, R.col(2), axis == 0 ? camera.fx : camera.fy,
                     sigma,      view.edge_exact[edge]};
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<EdgeCost, 1, kParameterCount>(cost),
                             new ceres::CauchyLoss(2.0), parameters);
  }
}

// Where the object is for sure: the mean of its points, or of the start where there are none.
Eigen::Vector3d SurePlace(const PosedSuperquadric& start, const RefinementInput& input) {
  if (input.points.empty()) {
    return start.T_map_object.translation;
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : input.points) {
    sum += p;
  }
  return sum / static_cast<double>(input.points.size());
}

// The largest half diagonal that a box shows, in map units at the object's place. What lies along the viewing
// rays of an object seen from one side only is not observed and would grow without bound from update to
// update.
double LargestShown(const PosedSuperquadric& start, const RefinementInput& input) {
  const Eigen::Vector3d place = SurePlace(start, input);
  double largest = 0.0;
  for (const SilhouetteView& view : input.views) {
    const double depth = (view.T_map_camera.Inverse() * place).z();
    largest = std::max(largest, 0.5 * std::hypot(view.box.width, view.box.height) * depth / input.camera.fx);
  }
  return largest;
}

// Map units per pixel at the object, in the middle view.
double UnitsPerPixel(const PosedSuperquadric& start, const RefinementInput& input) {
  std::vector<double> depths;
  for (const SilhouetteView& view : input.views) {
    depths.push_back((view.T_map_camera.Inverse() * start.T_map_object.translation).z());
  }
  if (depths.empty()) {
    return 0.01 * start.shape.half_size.mean();
  }
  std::nth_element(depths.begin(), depths.begin() + depths.size() / 2, depths.end());
  return std::max(depths[depths.size() / 2], 1e-6) / input.camera.fx;
}

void AddPoints(const PosedSuperquadric& start, const RefinementInput& input, const RefinementOptions& options,
               ceres::Problem& problem, double* parameters) {
  if (input.points.empty()) {
    return;
  }
  const double sigma =
      options.point_sigma_px * UnitsPerPixel(start, input) + 0.02 * start.shape.half_size.mean();
  constexpr std::size_t kMaxPoints = 150;
  const double weight = std::min(
      1.0, 4.0 * options.point_weight / static_cast<double>(std::min(input.points.size(), kMaxPoints)));
  const double step = 0.5 * start.shape.half_size.mean();
  const std::size_t stride = (input.points.size() + kMaxPoints - 1) / kMaxPoints;
  for (std::size_t i = 0; i < input.points.size(); i += stride) {
    const Eigen::Vector3d& p = input.points[i];
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<SurfaceCost, 1, kParameterCount>(new SurfaceCost{p, 1.0 / sigma}),
        new ceres::ScaledLoss(new ceres::CauchyLoss(1.5), weight, ceres::TAKE_OWNERSHIP), parameters);
    if (i / stride % 2 == 0 && i < input.point_cameras.size()) {
      const Eigen::Vector3d to_camera = (input.point_cameras[i] - p).normalized();
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<FreeSpaceCost, 1, kParameterCount>(
              new FreeSpaceCost{p + step * to_camera, 1.0 / sigma}),
          new ceres::ScaledLoss(new ceres::CauchyLoss(1.5), 2.0 * weight, ceres::TAKE_OWNERSHIP), parameters);
    }
  }
}

void AddContactAndPrior(const PosedSuperquadric& start, const RefinementInput& input,
                        const RefinementOptions& options, ceres::Problem& problem, double* parameters) {
  const std::optional<double>& floor = input.support_height ? input.support_height : input.lowest;
  if (floor) {
    const double height = std::max(2.0 * start.shape.half_size.z(), 0.5 * start.shape.half_size.maxCoeff());
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<ContactCost, 1, kParameterCount>(new ContactCost{
            *floor, 1.0 / (options.contact_sigma * height), input.support_height.has_value()}),
        new ceres::ScaledLoss(nullptr, options.contact_weight, ceres::TAKE_OWNERSHIP), parameters);
  }
  constexpr double kYawSigma = 5.0 * std::numbers::pi / 180.0;
  const PriorCost prior{options.prior_e1, options.prior_e2, 1.0 / options.prior_e_sigma,
                        input.yaw ? input.yaw->yaw : 0.0, input.yaw ? input.yaw->quality / kYawSigma : 0.0};
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<PriorCost, 4, kParameterCount>(new PriorCost(prior)), nullptr,
      parameters);
}

}  // namespace

RefinementResult RefineJointly(const PosedSuperquadric& start, const RefinementInput& input,
                               const RefinementOptions& options) {
  Parameters parameters = PackParameters(start);
  ceres::Problem problem;
  for (const SilhouetteView& view : input.views) {
    AddEdges(view, input.camera, options, problem, parameters.data());
  }
  AddPoints(start, input, options, problem, parameters.data());
  AddContactAndPrior(start, input, options, problem, parameters.data());
  for (int i = kExponents; i < kParameterCount; ++i) {
    problem.SetParameterLowerBound(parameters.data(), i, kMinShapeExponent);
    problem.SetParameterUpperBound(parameters.data(), i, kMaxShapeExponent);
  }
  const double shown = LargestShown(start, input);
  const double largest =
      std::log(shown > 0.0 ? options.max_stretch * shown : 4.5 * start.shape.half_size.maxCoeff());
  for (int i = kLogHalf; i < kLogHalf + 3; ++i) {
    problem.SetParameterLowerBound(parameters.data(), i, largest - 6.5);
    problem.SetParameterUpperBound(parameters.data(), i, largest);
    parameters[i] = std::clamp(parameters[i], largest - 6.0, largest - 0.01);
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  solver.max_num_iterations = options.max_iterations;
  solver.logging_type = ceres::SILENT;
  solver.function_tolerance = 1e-4;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  return {UnpackParameters(parameters), summary.final_cost};
}

}  // namespace sqslam
