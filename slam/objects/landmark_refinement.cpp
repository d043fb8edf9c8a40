#include "slam/objects/landmark_refinement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "slam/objects/joint_refinement.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/landmark_outliers.h"
#include "slam/objects/size_shape.h"

namespace sqslam {
namespace {

constexpr std::size_t kBottomEdge = 3;

std::optional<YawEstimate> YawFromAllLines(const Landmark& landmark, const EstimationContext& context) {
  std::vector<LineView> views;
  for (const auto& [frame, view] : landmark.lines) {
    views.push_back(view);
  }
  return YawFromLines(views, context.camera, context.options->yaw);
}

bool IsFlat(const Landmark& landmark, const RefinementOptions& options) {
  return std::ranges::find(options.flat_labels, landmark.labels.Best()) != options.flat_labels.end();
}

// Box-like, cylinder-like and ball-like at the yaw of the lines and of the cloud, and the last result. A box
// can't turn into a ball by small steps that each fit better. A screen that stands is thin along either axis.
std::vector<PosedSuperquadric> RefinementStarts(const Landmark& landmark,
                                                const std::vector<Eigen::Vector3d>& points,
                                                const std::optional<YawEstimate>& line_yaw,
                                                const ObjectOptions& options) {
  std::vector<double> yaws;
  if (line_yaw) {
    yaws.push_back(line_yaw->yaw);
  }
  const auto pca = YawFromPoints(points, options.yaw);
  if (pca && (!line_yaw || std::abs(WrapQuarter(pca->yaw - line_yaw->yaw)) > 0.1)) {
    yaws.push_back(pca->yaw);
  }
  if (yaws.empty()) {
    yaws = {0.0, std::numbers::pi / 4.0};
  }
  std::vector<PosedSuperquadric> starts;
  if (landmark.refined) {
    starts.push_back(landmark.visible);
  }
  for (const double yaw : yaws) {
    PosedSuperquadric start = SuperquadricAtYaw(points, yaw, options.size_shape, false);
    const double thin = 0.1 * start.shape.half_size.maxCoeff();  // flat starts can't grow
    start.shape.half_size = start.shape.half_size.cwiseMax(thin);
    for (const auto& [e1, e2] : {std::pair(0.25, 0.25), std::pair(0.25, 1.0), std::pair(1.0, 1.0)}) {
      start.shape.e1 = e1;
      start.shape.e2 = e2;
      starts.push_back(start);
    }
    if (IsFlat(landmark, options.refinement)) {
      for (int axis = 0; axis < 2; ++axis) {
        PosedSuperquadric upright = start;
        upright.shape.e1 = upright.shape.e2 = 0.25;
        upright.shape.half_size[axis] = thin;
        starts.push_back(upright);
      }
    }
  }
  return starts;
}

}  // namespace

PosedSuperquadric StretchedTo(PosedSuperquadric start, double height) {
  Eigen::Vector3d& centre = start.T_map_object.translation;
  const double top =
      std::max(centre.z() + start.shape.half_size.z(), height + 1e-3 * start.shape.half_size.norm());
  start.shape.half_size.z() = 0.5 * (top - height);
  centre.z() = 0.5 * (top + height);
  return start;
}

bool IsBottomSeen(const std::vector<BoxView>& views) {
  constexpr double kMostlyHidden = 0.33;
  const auto free = std::count_if(views.begin(), views.end(),
                                  [](const BoxView& view) { return view.edge_free[kBottomEdge]; });
  return static_cast<double>(free) >= kMostlyHidden * static_cast<double>(views.size());
}

namespace {

RefinementInput InputOf(const Landmark& landmark, const std::vector<BoxView>& views,
                        const EstimationContext& context) {
  RefinementInput input;
  for (const auto& [id, p] : landmark.points) {
    const Landmark::PointVotes& vote = landmark.votes.at(id);
    input.points.push_back(p);
    input.point_cameras.push_back({vote.MeanCamera(), vote.CameraSpread()});
  }
  input.camera = context.camera;
  input.is_flat = IsFlat(landmark, context.options->refinement);
  const bool bottom_seen = IsBottomSeen(views);
  for (const BoxView& view : views) {
    std::array<bool, 4> exact = view.edge_free;
    exact[kBottomEdge] = exact[kBottomEdge] && bottom_seen;
    input.views.push_back({view.T_map_camera, UndistortBox(view.box, context.camera), exact});
  }
  return input;
}

}  // namespace

namespace {

struct Candidate {
  PosedSuperquadric start;
  std::optional<double> support;
  double cost = 0.0;
};

// Every `stride`-th view and point of the input.
RefinementInput Thinned(const RefinementInput& input, std::size_t stride) {
  RefinementInput thinned = input;
  thinned.views.clear();
  for (std::size_t i = 0; i < input.views.size(); i += stride) {
    thinned.views.push_back(input.views[i]);
  }
  thinned.points.clear();
  thinned.point_cameras.clear();
  for (std::size_t i = 0; i < input.points.size(); i += stride) {
    thinned.points.push_back(input.points[i]);
    if (i < input.point_cameras.size()) {
      thinned.point_cameras.push_back(input.point_cameras[i]);
    }
  }
  return thinned;
}

// The starts under all assumptions.
std::vector<Candidate> AllCandidates(std::span<const PosedSuperquadric> starts,
                                     std::span<const double> supports) {
  std::vector<std::optional<double>> assumptions(supports.begin(), supports.end());
  assumptions.push_back(std::nullopt);
  std::vector<Candidate> candidates;
  for (const std::optional<double>& support : assumptions) {
    for (const PosedSuperquadric& start : starts) {
      candidates.push_back({support ? StretchedTo(start, *support) : start, support, 0.0});
    }
  }
  return candidates;
}

void Assume(const std::optional<double>& support, std::span<const double> supports, RefinementInput& input) {
  input.support_height = support;
  input.lowest.reset();
  if (!support && !supports.empty()) {
    input.lowest = *std::max_element(supports.begin(), supports.end());
  }
}

// Keeps the candidates that lead to the lowest costs within a few steps on a part of the data. What they lead
// to is forgotten: a full refinement that starts there ends in worse places than one from the start itself.
void KeepPromising(const RefinementInput& input, std::span<const double> supports,
                   const RefinementOptions& options, std::vector<Candidate>& candidates) {
  constexpr std::size_t kKept = 2;
  constexpr std::size_t kViews = 10;
  constexpr int kSteps = 8;
  const std::size_t stride = std::max<std::size_t>(1, input.views.size() / kViews);
  RefinementInput part = Thinned(input, stride);
  // What stands against the boxes weighs as much less as there are fewer of them.
  const double share = 1.0 / static_cast<double>(stride);
  RefinementOptions quick = options;
  quick.max_iterations = std::min(kSteps, options.max_iterations);
  quick.point_weight *= share;
  quick.contact_weight *= share;
  for (Candidate& candidate : candidates) {
    Assume(candidate.support, supports, part);
    candidate.cost = RefineJointly(candidate.start, part, quick, false).cost +
                     (candidate.support ? 0.0 : share * options.floating_cost);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
  candidates.resize(std::min(candidates.size(), kKept));
}

}  // namespace

StandingFit RefineStanding(std::span<const PosedSuperquadric> starts, RefinementInput input,
                           std::span<const double> supports, const RefinementOptions& options,
                           bool only_promising) {
  std::vector<Candidate> candidates = AllCandidates(starts, supports);
  if (only_promising) {
    KeepPromising(input, supports, options, candidates);
  }
  StandingFit best;
  best.cost = std::numeric_limits<double>::infinity();
  for (const Candidate& candidate : candidates) {
    Assume(candidate.support, supports, input);
    const RefinementResult result = RefineJointly(candidate.start, input, options);
    const double cost = result.cost + (candidate.support ? 0.0 : options.floating_cost);
    if (cost < best.cost) {
      best = {result.superquadric, candidate.support, cost, result.covariance};
    }
  }
  return best;
}

StandingFit RefineLandmark(const Landmark& landmark, const std::vector<BoxView>& views, bool thorough,
                           const EstimationContext& context) {
  const ObjectOptions& options = *context.options;
  RefinementInput input = InputOf(landmark, views, context);
  input.yaw = YawFromAllLines(landmark, context);
  const std::vector<double> supports = PossibleSupports(landmark.points, *context.supports);
  if (thorough || !landmark.refined) {
    const auto starts = RefinementStarts(landmark, input.points, input.yaw, options);
    return RefineStanding(starts, std::move(input), supports, options.refinement, !context.thorough);
  }
  if (landmark.support && !supports.empty()) {
    input.support_height = *std::min_element(supports.begin(), supports.end(), [&](double a, double b) {
      return std::abs(a - *landmark.support) < std::abs(b - *landmark.support);
    });
  }
  const std::optional<double> support = input.support_height;
  if (!support && !supports.empty()) {
    input.lowest = *std::max_element(supports.begin(), supports.end());
  }
  const RefinementResult result = RefineJointly(landmark.visible, input, options.refinement);
  return {result.superquadric, support, result.cost, result.covariance};
}

}  // namespace sqslam
