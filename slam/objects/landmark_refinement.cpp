#include "slam/objects/landmark_refinement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <ranges>
#include <utility>

#include "slam/objects/dual_quadric.h"
#include "slam/objects/joint_refinement.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/landmark_outliers.h"
#include "slam/objects/size_shape.h"
#include "slam/objects/visibility.h"
#include "slam/util/thinned.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr double kUnlikely = 0.1;  // kinds of shape with a smaller share are not tried

std::vector<YawMode> YawsOfAllLines(const Landmark& landmark, const EstimationContext& context) {
  const std::vector<LineView> views = ToVector(landmark.lines | std::views::values);
  return YawModesFromLines(views, context.camera, context.options->yaw);
}

// Returns a start of each kind of shape at each yaw of the lines and of the cloud, and the last result. A box
// cannot turn into a ball by small steps that each fit better.
std::vector<PosedSuperquadric> RefinementStarts(const Landmark& landmark,
                                                const std::vector<Eigen::Vector3d>& points,
                                                const RefinementInput& input, const ObjectOptions& options) {
  constexpr double kOther = 0.1;  // radians
  std::vector<double> yaws = ToVector(input.yaws, &YawMode::yaw);
  const auto pca = YawFromPoints(points, options.yaw);
  if (pca && std::ranges::none_of(
                 yaws, [&](double yaw) { return std::abs(WrapQuarter(pca->yaw - yaw)) <= kOther; })) {
    yaws.push_back(pca->yaw);
  }
  if (yaws.empty()) {
    yaws = {0.0, std::numbers::pi / 4.0};
  } else if (!pca) {
    yaws.push_back(yaws.front() + std::numbers::pi / 4.0);  // the lines may all be a pattern's
  }
  std::vector<PosedSuperquadric> starts;
  if (landmark.refined) {
    starts.push_back(landmark.visible);
  }
  for (const double yaw : yaws) {
    PosedSuperquadric start = SuperquadricAtYaw(points, yaw, options.size_shape, false);
    const double thin = 0.1 * start.shape.half_size.maxCoeff();  // flat starts can't grow
    start.shape.half_size = start.shape.half_size.cwiseMax(thin);
    // Also with the width ratio of the class along either axis: points of one side do not show the depth.
    constexpr double kClearlyLonger = 0.15;
    std::vector<PosedSuperquadric> sized = {start};
    if (input.prior.log_width_ratio > kClearlyLonger) {
      const double longer = start.shape.half_size.head<2>().maxCoeff();
      for (int axis = 0; axis < 2; ++axis) {
        sized.push_back(start);
        sized.back().shape.half_size[axis] = longer * std::exp(-input.prior.log_width_ratio);
        sized.back().shape.half_size[1 - axis] = longer;
      }
    }
    for (PosedSuperquadric& one : sized) {
      for (const SolidKind kind : kPrimitives) {
        if (input.prior.shapes[static_cast<std::size_t>(kind)] < kUnlikely) {
          continue;
        }
        const auto [e1, e2] = UsualExponents(kind);
        one.shape.e1 = e1;
        one.shape.e2 = e2;
        starts.push_back(one);
      }
    }
  }
  return starts;
}

// True for the back of a seat, false for a seat.
bool IsPlate(const Superquadric& shape) {
  constexpr double kThin = 0.5;
  const auto& horizontal = shape.half_size.head<2>();
  return horizontal.minCoeff() < kThin * horizontal.maxCoeff();
}

// Place and half diagonal of something far away in the box of the middle view.
Sim3d FarFrameOf(const std::vector<BoxView>& views, const Camera& camera) {
  constexpr double kDepthInPaths = 10.0;  // of the path of the camera
  const BoxView& view = views[views.size() / 2];
  const Box2d box = UndistortBox(view.box, camera);
  const double path = (views.back().T_map_camera.translation - views.front().T_map_camera.translation).norm();
  const double depth = std::max(kDepthInPaths * path, 1e-6);
  const double size = 0.5 * depth * std::hypot(box.width / camera.fx, box.height / camera.fy);
  return {size, Eigen::Quaterniond::Identity(), view.T_map_camera * (depth * camera.Unproject(box.Center()))};
}

// Stands in for the points of an object without any: the corners of an upright cube at the position and of
// the size that its boxes show.
NamedPoints CornersOf(const Sim3d& S_map_cube) {
  constexpr double kHalf = 0.6;  // of the median half diagonal of the boxes
  NamedPoints corners;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d signs(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    corners.emplace_back(corner, S_map_cube * (kHalf * signs));
  }
  return corners;
}

RefinementInput InputOf(const Landmark& landmark, const std::vector<BoxView>& views,
                        const EstimationContext& context) {
  RefinementInput input;
  for (const auto& [id, p] : landmark.points) {
    const Landmark::PointVotes& vote = landmark.votes.at(id);
    input.points.push_back({p, vote.MeanCamera(), vote.CameraSpread(p)});
  }
  input.camera = context.camera;
  input.edge_information = context.edge_information;
  input.prior = context.classes->Of(landmark.labels.Best());
  input.yaws = YawsOfAllLines(landmark, context);
  input.scale = context.scale;
  input.top_height = context.surroundings.top_height;
  const bool bottom_seen = IsBottomSeen(views);
  input.may_show_back = input.prior.back && landmark.estimated && !bottom_seen &&
                        OccluderOfBottom(landmark, input.prior.on_floor, context.surroundings.others, views,
                                         context.camera) != nullptr;
  const auto first = static_cast<double>(views.front().frame_index);
  const auto last = static_cast<double>(views.back().frame_index);
  for (const BoxView& view : views) {
    const double time =
        (static_cast<double>(view.frame_index) - 0.5 * (first + last)) / std::max(1.0, last - first);
    input.views.push_back(
        {view.T_map_camera, UndistortBox(view.box, context.camera), ExactEdges(view, bottom_seen), time});
  }
  return input;
}

struct Candidate {
  PosedSuperquadric start;
  Assumption assumption;
  double cost = 0.0;
  SolidKind kind = SolidKind::kCuboid;
};

SolidKind KindOf(const PosedSuperquadric& solid) { return NearestPrimitive(solid.shape.e1, solid.shape.e2); }

std::vector<Candidate> AllCandidates(std::span<const PosedSuperquadric> starts,
                                     std::span<const Assumption> assumptions) {
  std::vector<Candidate> candidates;
  for (const Assumption& assumption : assumptions) {
    for (const PosedSuperquadric& start : starts) {
      candidates.push_back(
          {assumption.support ? StretchedTo(start, *assumption.support) : start, assumption});
    }
  }
  return candidates;
}

// Keeps every `stride`-th view of the input and at most as large a share of its points, at most 50.
RefinementInput Thinned(const RefinementInput& input, std::size_t stride) {
  constexpr std::size_t kMostPoints = 50;
  RefinementInput thinned = input;
  thinned.views = EveryNth(input.views, stride);
  thinned.points = EveryNth(input.points, std::max(stride, StepThrough(input.points.size(), kMostPoints)));
  return thinned;
}

// Keeps the candidates with the lowest costs after a few steps on a part of the data. The intermediate
// results are discarded: a full refinement from them ends in worse minima than one from the start itself.
void KeepPromising(const RefinementInput& input, const RefinementOptions& options,
                   std::vector<Candidate>& candidates) {
  constexpr std::size_t kKept = 3;
  constexpr std::size_t kViews = 10;
  constexpr std::size_t kFinalists = 20;  // that are followed further than their first steps
  constexpr int kFirstSteps = 3;
  constexpr int kSteps = 8;
  const std::size_t stride = std::max<std::size_t>(1, input.views.size() / kViews);
  RefinementInput part = Thinned(input, stride);
  // Other terms are weighted down with the number of boxes.
  const double share = 1.0 / static_cast<double>(stride);
  RefinementOptions quick = options;
  quick.point_weight *= share;
  quick.contact_weight *= share;
  const auto rank = [&](int steps) {
    quick.max_iterations = std::min(steps, options.max_iterations);
    for (Candidate& candidate : candidates) {
      part.assumption = candidate.assumption;
      candidate.cost = RefineJointly(candidate.start, part, quick, RefinementDepth::kQuick).cost +
                       share * candidate.assumption.cost;
    }
    std::ranges::stable_sort(candidates, {}, &Candidate::cost);
  };
  if (candidates.size() > kFinalists) {
    rank(kFirstSteps);
    candidates.resize(kFinalists);
  }
  rank(kSteps);
  // Keep at least two kinds of shape, which the short run hardly tells apart.
  const auto kind = [](const Candidate& candidate) {
    return NearestPrimitive(candidate.start.shape.e1, candidate.start.shape.e2);
  };
  const auto other = std::ranges::find_if(
      candidates, [&](const Candidate& candidate) { return kind(candidate) != kind(candidates.front()); });
  if (other != candidates.end()) {
    std::rotate(candidates.begin() + 1, other, other + 1);
  }
  candidates.resize(std::min(candidates.size(), kKept));
}

// Returns variants of `s`: one side half or twice as far from the opposite one, turned by an eighth, or
// another shape.
std::vector<PosedSuperquadric> Neighbours(const PosedSuperquadric& s) {
  std::vector<PosedSuperquadric> neighbours;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      for (const double factor : {0.5, 2.0}) {
        PosedSuperquadric moved = s;
        moved.shape.half_size[axis] *= factor;
        const double step = side * (moved.shape.half_size[axis] - s.shape.half_size[axis]);
        moved.T_map_object.translation += step * (s.T_map_object.rotation * Eigen::Vector3d::Unit(axis));
        neighbours.push_back(moved);
      }
    }
  }
  PosedSuperquadric turned = s;
  turned.T_map_object.rotation =
      s.T_map_object.rotation * Eigen::AngleAxisd(0.25 * std::numbers::pi, Eigen::Vector3d::UnitZ());
  neighbours.push_back(turned);
  for (const SolidKind kind : kPrimitives) {
    const auto [e1, e2] = UsualExponents(kind);
    PosedSuperquadric reshaped = s;
    reshaped.shape.e1 = e1;
    reshaped.shape.e2 = e2;
    neighbours.push_back(reshaped);
  }
  return neighbours;
}

// Refines all candidates as one solid and the likeliest ones also as parts; updates `best` if one is better.
void FollowAll(const std::vector<Candidate>& candidates, const RefinementOptions& options,
               RefinementInput& input, StandingFit& best) {
  constexpr std::size_t kOfParts = 3;
  const auto keep = [&](const RefinementResult& result) {
    if (result.cost + input.assumption.cost < best.cost) {
      best = {result, input.assumption, {}};
      best.cost += input.assumption.cost;
    }
  };
  std::vector<Candidate> fits;
  for (const Candidate& candidate : candidates) {
    input.assumption = candidate.assumption;
    const RefinementResult result = RefineJointly(candidate.start, input, options);
    keep(result);
    fits.push_back({result.superquadric, candidate.assumption, result.cost + candidate.assumption.cost,
                    KindOf(candidate.start)});
  }
  std::ranges::stable_sort(fits, {}, &Candidate::cost);
  std::size_t tried = 0;
  for (std::size_t i = 0; i < fits.size() && tried < kOfParts; ++i) {
    input.assumption = fits[i].assumption;
    if (const auto parts = RefineParts(fits[i].start, fits[i].kind, input, options)) {
      keep(*parts);
      ++tried;
    }
  }
}

}  // namespace

std::optional<StandingFit> RefineLandmark(const Landmark& landmark, const std::vector<BoxView>& views,
                                          bool thorough, const EstimationContext& context) {
  const ObjectOptions& options = *context.options;
  NamedPoints cloud = landmark.points;
  bool placed = true;
  if (cloud.size() < kMinPoints) {
    const std::optional<Sim3d> S_map_cube = FrameOfBoxes(views, context.camera);
    placed = S_map_cube.has_value();
    if (!placed && landmark.observations < options.min_observations) {
      return std::nullopt;
    }
    cloud = CornersOf(placed ? *S_map_cube : FarFrameOf(views, context.camera));
  }
  RefinementInput input = InputOf(landmark, views, context);
  const SupportHeights supports = PossibleSupports(cloud, context);
  if (thorough || !landmark.refined) {
    const auto starts = RefinementStarts(landmark, Positions(cloud), input, options);
    StandingFit fit = RefineStanding(starts, std::move(input), supports, options.refinement,
                                     context.thorough ? SearchEffort::kThorough : SearchEffort::kPromising);
    fit.placed = placed;
    return fit;
  }
  const std::optional<double> support = SupportOf(landmark, supports);
  input.assumption = {.support = support,
                      .lowest = support ? std::nullopt : LowestOf(supports, input.prior),
                      .sigma = support ? supports.SigmaOf(*support) : supports.sigma,
                      .shows_back = input.may_show_back && IsPlate(landmark.visible.shape)};
  RefinementResult result = RefineJointly(landmark.visible, input, options.refinement);
  if (const auto parts = RefineParts(landmark.visible, KindOf(landmark.visible), input, options.refinement);
      parts && parts->cost < result.cost) {
    result = *parts;
  }
  return StandingFit{result, input.assumption, {}, placed};
}

StandingFit RefineStanding(std::span<const PosedSuperquadric> starts, RefinementInput input,
                           const SupportHeights& supports, const RefinementOptions& options,
                           SearchEffort effort) {
  constexpr int kMostRounds = 4;
  constexpr double kEnough = 0.5;  // half a chi square
  std::vector<Candidate> candidates =
      AllCandidates(starts, Assumptions(supports, input, options, effort == SearchEffort::kThorough));
  if (effort == SearchEffort::kPromising) {
    KeepPromising(input, options, candidates);
  }
  StandingFit best;
  best.cost = std::numeric_limits<double>::infinity();
  FollowAll(candidates, options, input, best);
  double before = std::numeric_limits<double>::infinity();
  for (int round = 0;
       effort == SearchEffort::kThorough && round < kMostRounds && best.cost < before - kEnough; ++round) {
    before = best.cost;
    const std::vector<PosedSuperquadric> neighbours = Neighbours(best.superquadric);
    FollowAll(AllCandidates(neighbours, {&best.assumption, 1}), options, input, best);
  }
  input.assumption = best.assumption;
  best.motion = FitMotion(best.superquadric, starts.front(), input, options);
  return best;
}

}  // namespace sqslam
