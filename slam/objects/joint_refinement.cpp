#include "slam/objects/joint_refinement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "slam/geometry/angles.h"
#include "slam/geometry/ray.h"
#include "slam/objects/visibility.h"
#include "slam/util/statistics.h"
#include "slam/util/thinned.h"
#include "slam/util/to_vector.h"

namespace sqslam {

namespace {

// Returns a point within the object: the mean of its points, or without points the one nearest to the rays
// through the centres of the boxes.
Eigen::Vector3d PlaceOf(const RefinementInput& input) {
  if (!input.points.empty()) {
    const auto add = [](const Eigen::Vector3d& sum, const SeenPoint& point) -> Eigen::Vector3d {
      return sum + point.p_map;
    };
    return std::accumulate(input.points.begin(), input.points.end(), Eigen::Vector3d::Zero().eval(), add) /
           static_cast<double>(input.points.size());
  }
  RaySum rays{.information = 1e-9 * Eigen::Matrix3d::Identity()};
  for (const SilhouetteView& view : input.views) {
    rays.Add({view.T_map_camera.translation,
              (view.T_map_camera.rotation * input.camera.Unproject(view.box.Center())).normalized()});
  }
  return rays.Nearest();
}

// Returns the map units per pixel at the object, at its median depth.
double UnitsPerPixel(const RefinementInput& input, const Eigen::Vector3d& place) {
  std::vector<double> depths = ToVector(
      input.views, [&](const SilhouetteView& view) { return (view.T_map_camera.Inverse() * place).z(); });
  return depths.empty() ? 1e-6 : std::max(UpperMedian(std::move(depths)), 1e-6) / input.camera.fx;
}

// Returns the half diagonal of the object that its boxes show, map units at the depth of `place`. Nine boxes
// in ten are smaller: a single one may be wrong. 0 without views.
double ShownSize(const RefinementInput& input, const Eigen::Vector3d& place) {
  constexpr double kQuantile = 0.9;
  std::vector<double> sizes = ToVector(input.views, [&](const SilhouetteView& view) {
    const double depth = (view.T_map_camera.Inverse() * place).z();
    return std::max(0.0, 0.5 * std::hypot(view.box.width, view.box.height) * depth / input.camera.fx);
  });
  return sizes.empty() ? 0.0 : LinearQuantile(std::move(sizes), kQuantile);
}

// Standard deviation of a point's radial distance due to its depth, map units: the less the cameras moved,
// the less certain the point is along the line of sight. A surface seen at a grazing angle is not affected,
// because the distance is measured along the radius.
double RadialSigma(const SeenPoint& point, const Eigen::Vector3d& place, const Camera& camera,
                   double pixel_sigma) {
  constexpr double kLeastSpread = 0.01;  // of the distance: bundle adjustment ties the depths together
  const Eigen::Vector3d line = point.p_map - point.mean_camera;
  const double along = std::abs(line.normalized().dot((point.p_map - place).normalized()));
  const double spread = std::max(kLeastSpread * line.norm(), point.camera_spread);
  return along * pixel_sigma * line.squaredNorm() / (camera.fx * spread);
}

void AddPoints(const RefinementInput& input, const Eigen::Vector3d& place, double shown,
               const RefinementOptions& options, ObjectEnergy& energy) {
  constexpr std::size_t kMaxPoints = 75;
  if (input.points.empty()) {
    return;
  }
  const double sigma =
      options.point_sigma_px * UnitsPerPixel(input, place) + options.point_sigma_share * shown;
  const double step = 0.3 * shown;
  const std::size_t stride = StepThrough(input.points.size(), kMaxPoints);
  const std::size_t used = (input.points.size() + stride - 1) / stride;
  const double weight = std::min(1.0, 4.0 * options.point_weight / static_cast<double>(used));
  for (std::size_t i = 0; i < input.points.size(); i += stride) {
    const Eigen::Vector3d& p = input.points[i].p_map;
    const double radial = RadialSigma(input.points[i], place, input.camera, options.depth_sigma_px);
    energy.points.push_back({p, 1.0 / std::hypot(sigma, radial), weight, true});
    energy.point_count += weight;
    if (i / stride % 2 == 0) {
      // A point in front of it on the line of sight is outside.
      const Eigen::Vector3d to_camera = (input.points[i].mean_camera - p).normalized();
      energy.points.push_back({p + step * to_camera, 1.0 / sigma, 2.0 * weight, false});
    }
  }
}

void AddContact(const RefinementInput& input, double shown, const RefinementOptions& options,
                ObjectEnergy& energy) {
  constexpr double kFlat = 0.01;  // standard deviation of a top that others stand on, share of the shown size
  const auto factor = [&](double share) {
    return std::sqrt(options.contact_weight) / std::hypot(share * shown, input.assumption.sigma);
  };
  const auto& [support, lowest, cost, sigma, shows_back] = input.assumption;
  if (support || lowest) {
    energy.contacts.push_back({support ? *support : *lowest, factor(options.contact_sigma),
                               support.has_value(), -1.0, 2.0 * shown});
  }
  if (input.top_height) {
    energy.contacts.push_back({*input.top_height, factor(kFlat), true, 1.0, 2.0 * shown});
  }
}

// Returns the yaw mode nearest to the start; null without lines.
const YawMode* YawMeant(const PosedSuperquadric& start, const RefinementInput& input) {
  const double yaw = YawOf(start.T_map_object.rotation);
  const auto nearest = std::ranges::min_element(
      input.yaws, {}, [yaw](const YawMode& mode) { return std::abs(WrapQuarter(mode.yaw - yaw)); });
  return nearest == input.yaws.end() ? nullptr : &*nearest;
}

void AddSize(const Superquadric& start, const SizePrior& known, const RefinementInput& input,
             ObjectEnergy& energy) {
  energy.AddProportions(known, start.half_size.x() >= start.half_size.y() ? 0 : 1);
  if (input.scale && known.log_metres) {
    energy.classes.push_back({Eigen::Vector3d::Constant(1.0 / 3.0),
                              *known.log_metres - input.scale->log_scale - std::log(2.0),
                              1.0 / std::hypot(known.size_sigma, input.scale->sigma)});
  }
}

void AddShape(const Superquadric& start, const ObjectClass& known, const RefinementOptions& options,
              ObjectEnergy& energy) {
  constexpr double kCupTaper = 0.3;
  constexpr double kProfile = 2.0;     // the tapers explain most of what e1 would
  constexpr double kRound = 4.0;       // turned on a lathe or a wheel
  constexpr double kStraight = 100.0;  // inverse standard deviation of ends that are not narrower, or wider
  const SolidKind kind = NearestPrimitive(start.e1, start.e2);
  const bool is_cylinder = kind == SolidKind::kCylinder;
  energy.variant.tapered = is_cylinder && options.taper_sigma > 0.0;
  const auto [e1, e2] = UsualExponents(kind);
  const double factor = 1.0 / options.exponent_sigma;
  energy.exponents.push_back({0, e1, (energy.variant.tapered ? kProfile : 1.0) * factor});
  energy.exponents.push_back({1, e2, (is_cylinder ? kRound : 1.0) * factor});
  for (int side = 0; side < 4; ++side) {
    const double bias = 1.0 / options.edge_bias_sigma;
    energy.normals.push_back({parameter::kBias + side, bias, bias});
  }
  // Other parts, such as a handle, rather than a waist make the boxes of a class with parts wide.
  const double taper_sigma = (known.parts.empty() ? 1.0 : kCupTaper) * options.taper_sigma;
  for (int end = 0; end < 2; ++end) {
    energy.normals.push_back(
        {parameter::kTaper + end, energy.variant.tapered ? 1.0 / taper_sigma : kStraight, kStraight});
  }
}

// Bounds the half sizes by the extent that the boxes show: along the viewing rays an object seen from one
// side only would grow without bound from update to update. If no box shows the lower end, the object may be
// as high as its support requires.
void AddBounds(const PosedSuperquadric& start, const RefinementInput& input, double shown,
               ObjectEnergy& energy) {
  constexpr double kLogRange = 6.5;
  constexpr double kTaller = 1.2;   // the top is not known exactly
  constexpr double kLargest = 1.1;  // the largest box over the size that most show
  const double most = shown > 0.0 ? kLargest * shown : 4.5 * start.shape.half_size.maxCoeff();
  Eigen::Vector3d max_half = Eigen::Vector3d::Constant(most);
  if (input.assumption.support && !input.ShowsBottom()) {
    const double top = start.T_map_object.translation.z() + start.shape.half_size.z();
    max_half.z() = std::max(most, kTaller * 0.5 * (top - *input.assumption.support));
  }
  for (int axis = 0; axis < 3; ++axis) {
    energy.bounds.push_back({axis, std::log(most) - kLogRange, std::log(max_half[axis])});
  }
}

template <int kRows>
double Minimise(const ObjectEnergy& energy, const RefinementOptions& options,
                Eigen::Matrix<double, kRows, 1>& x) {
  return Minimise(energy, options.max_iterations, options.cost_tolerance, x);
}

// The refinement from `start`, with the yaw mode that is meant; null without lines.
struct StartedRefinement {
  ObjectEnergy energy;
  SolidParameters x;
  const YawMode* yaw = nullptr;
};

StartedRefinement Started(const PosedSuperquadric& start, const RefinementInput& input,
                          const RefinementOptions& options) {
  StartedRefinement started;
  ObjectEnergy& energy = started.energy;
  for (const SilhouetteView& view : input.views) {
    energy.AddEdges(view, input.camera, options);
  }
  energy.edge_information = input.edge_information;
  const Eigen::Vector3d place = PlaceOf(input);
  const double shown = ShownSize(input, place);
  AddPoints(input, place, shown, options, energy);
  AddContact(input, shown, options, energy);
  AddSize(start.shape, input.assumption.shows_back ? BackOf(input.prior) : input.prior, input, energy);
  AddShape(start.shape, input.prior, options, energy);
  started.yaw = YawMeant(start, input);
  if (started.yaw != nullptr) {
    energy.yaws.push_back({started.yaw->yaw, 1.0 / started.yaw->sigma});
  }
  AddBounds(start, input, shown, energy);
  started.x = PackSolid(start);
  for (const BoundTerm& bound : energy.bounds) {
    double& log_half = started.x[parameter::kLogHalf + bound.axis];
    log_half = std::clamp(log_half, bound.least + 0.5, bound.most - 0.01);
  }
  return started;
}

// Makes overshooting the edges of whole views cost as much as falling short of them; true if there are any.
bool MakeSymmetric(ObjectEnergy& energy) {
  for (EdgeTerm& edge : energy.edges) {
    edge.symmetric = edge.whole;
  }
  return std::ranges::any_of(energy.edges, &EdgeTerm::whole);
}

// Completes a full refinement from `x`, its first solution: with the symmetric loss only now, because local
// minima are more frequent with it.
template <int kRows>
RefinementResult Complete(ObjectEnergy energy, const RefinementOptions& options,
                          Eigen::Matrix<double, kRows, 1> x) {
  if (MakeSymmetric(energy)) {
    Minimise(energy, options, x);
  }
  const ObjectEvidence evidence = EvidenceAt(x, energy);
  RefinementResult result{UnpackSolid(x.template head<parameter::kCount>()), evidence.cost,
                          evidence.covariance};
  if constexpr (kRows == parameter::kMostCount) {
    result.parts = UnpackParts(x, energy.variant);
  }
  return result;
}

// Returns the templates of the class whose hull is of this kind.
std::vector<const PartTemplate*> TemplatesOf(const RefinementInput& input, SolidKind kind) {
  std::vector<const PartTemplate*> templates;
  for (const PartTemplate& of : input.prior.parts) {
    if (of.parts.front().shape == kind && !input.assumption.shows_back &&
        !(of.hangs && input.assumption.support)) {
      templates.push_back(&of);
    }
  }
  return templates;
}

// Returns `start` turned to the direction number `turn` of a template. A round body gets the width ratio of
// the template, and lies where the hull's middle moves away from it.
PosedSuperquadric TurnedTo(const PosedSuperquadric& start, const PartTemplate& of, int turn) {
  const double angle = turn * 2.0 * std::numbers::pi / std::max(of.turns, 4);
  PosedSuperquadric turned = start;
  turned.T_map_object.rotation =
      start.T_map_object.rotation * Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ());
  auto half = turned.shape.half_size.head<2>();
  if (!of.IsRound()) {
    half = turn % 2 == 0 ? half.eval() : half.reverse().eval();
  } else if (of.size) {
    const double ratio = std::exp(0.5 * of.size->log_width_ratio);
    half = std::sqrt(half.prod()) * Eigen::Vector2d(ratio, 1.0 / ratio);
    turned.T_map_object.translation +=
        0.5 * (half.x() - half.y()) * (turned.T_map_object.rotation * Eigen::Vector3d::UnitX());
  }
  return turned;
}

// An object of parts, turned about the vertical, before its refinement.
struct Direction {
  ObjectEnergy energy;
  AllParameters x = AllParameters::Zero();
  double cost = 0.0;
};

std::vector<Direction> DirectionsOf(const PosedSuperquadric& start, const PartTemplate& of,
                                    const RefinementInput& input, ObjectEnergy energy) {
  energy.variant.parts = &of;
  for (std::size_t k = 0; k < kMaxProportions; ++k) {
    const double factor = k < of.free.size() ? 1.0 / of.free[k].sigma : 1.0;
    energy.normals.push_back({parameter::kProportions + static_cast<int>(k), factor, factor});
  }
  if (of.IsRound()) {
    energy.yaws.clear();
  }
  std::vector<Direction> directions;
  for (int turn = 0; turn < of.turns; ++turn) {
    const PosedSuperquadric turned = TurnedTo(start, of, turn);
    Direction direction{.energy = energy};
    direction.energy.classes.clear();
    AddSize(turned.shape, of.size ? *of.size : input.prior, input, direction.energy);
    direction.x.head<parameter::kCount>() = PackSolid(turned);
    direction.cost = direction.energy.Cost(direction.x);
    directions.push_back(std::move(direction));
  }
  std::ranges::stable_sort(directions, {}, &Direction::cost);
  return directions;
}

// Refines the object as the parts of a template, from the directions that `start` leaves likeliest.
RefinementResult RefineAs(const PartTemplate& of, const PosedSuperquadric& start,
                          const RefinementInput& input, const RefinementOptions& options,
                          const ObjectEnergy& energy) {
  constexpr std::size_t kFollowed = 4;
  std::vector<Direction> directions = DirectionsOf(start, of, input, energy);
  RefinementResult best;
  best.cost = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < std::min(kFollowed, directions.size()); ++i) {
    Minimise(directions[i].energy, options, directions[i].x);
    RefinementResult result = Complete(std::move(directions[i].energy), options, directions[i].x);
    best = result.cost < best.cost ? std::move(result) : best;
  }
  best.cost += std::log(static_cast<double>(of.QuarterTurns())) - std::log(of.share);
  return best;
}

// Negative logarithm of the probability of the kind of shape and of the yaw of the lines, null without lines.
double ModeCost(SolidKind kind, const YawMode* yaw, const ObjectClass& prior) {
  return -std::log(prior.shapes[static_cast<std::size_t>(kind)]) -
         (yaw != nullptr ? std::log(yaw->share) : 0.0);
}

}  // namespace

bool RefinementInput::ShowsBottom() const {
  return std::ranges::any_of(views, [](const SilhouetteView& view) { return view.edge_exact[kBottomEdge]; });
}

RefinementResult RefineJointly(const PosedSuperquadric& start, const RefinementInput& input,
                               const RefinementOptions& options, RefinementDepth depth) {
  constexpr double kMinShare = 0.01;  // of those that are one solid
  auto [energy, x, yaw] = Started(start, input, options);
  const double cost = Minimise(energy, options, x);
  const SolidKind kind = NearestPrimitive(start.shape.e1, start.shape.e2);
  const double mode_cost = ModeCost(kind, yaw, input.prior);
  if (depth == RefinementDepth::kQuick) {
    return {UnpackSolid(x), cost + mode_cost, Eigen::Matrix<double, 9, 9>::Zero()};
  }
  double share = 1.0;
  for (const PartTemplate* of : TemplatesOf(input, kind)) {
    share -= of->share;
  }
  RefinementResult result = Complete(std::move(energy), options, x);
  result.cost += mode_cost - std::log(std::max(share, kMinShare));
  return result;
}

std::optional<RefinementResult> RefineParts(PosedSuperquadric start, SolidKind kind,
                                            const RefinementInput& input, const RefinementOptions& options) {
  start.shape.e1 = UsualExponents(kind)[0];
  start.shape.e2 = UsualExponents(kind)[1];
  std::optional<RefinementResult> best;
  for (const PartTemplate* of : TemplatesOf(input, kind)) {
    const auto [energy, x, yaw] = Started(start, input, options);
    RefinementResult result = RefineAs(*of, start, input, options, energy);
    result.cost += ModeCost(kind, of->IsRound() ? nullptr : yaw, input.prior);
    result.cost -= of->hangs ? input.assumption.cost : 0.0;  // it needs no support
    if (!best || result.cost < best->cost) {
      best = std::move(result);
    }
  }
  return best;
}

MotionFit FitMotion(const PosedSuperquadric& at_rest, const PosedSuperquadric& start,
                    const RefinementInput& input, const RefinementOptions& options) {
  constexpr double kDisplacementSigma = 100.0;  // of the object's size: hardly a bound
  double cost_at_rest = 0.0;
  double least = std::numeric_limits<double>::infinity();
  MotionFit fit;
  for (const PosedSuperquadric* from : {&at_rest, &start}) {
    auto [energy, at_start, yaw] = Started(*from, input, options);
    MakeSymmetric(energy);
    if (from == &at_rest) {
      cost_at_rest = Minimise(energy, options, at_start);
    }
    energy.variant.moving = true;
    const double factor = 1.0 / (kDisplacementSigma * from->shape.half_size.norm());
    for (int axis = 0; axis < 3; ++axis) {
      energy.normals.push_back({parameter::kDisplacement + axis, factor, factor});
    }
    AllParameters x = AllParameters::Zero();
    x.head<parameter::kCount>() = at_start;
    const int iterations = 2 * options.max_iterations;  // the boxes hardly determine the motion
    if (from == &start) {  // points behind a moving thing hold it in place: the boxes alone find its motion
      ObjectEnergy of_boxes = energy;
      of_boxes.points.clear();
      Minimise(of_boxes, iterations, options.cost_tolerance, x);
    }
    const double cost = Minimise(energy, iterations, options.cost_tolerance, x);
    if (cost < least) {
      least = cost;
      fit = {cost_at_rest - cost, x.segment<3>(parameter::kDisplacement),
             UnpackSolid(x.head<parameter::kCount>())};
    }
  }
  return fit;
}

}  // namespace sqslam
