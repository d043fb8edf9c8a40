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

StandingFit RefineLandmark(const Landmark& landmark, const std::vector<BoxView>& views, bool thorough,
                           const EstimationContext& context) {
  const ObjectOptions& options = *context.options;
  RefinementInput input = InputOf(landmark, views, context);
  input.yaw = YawFromAllLines(landmark, context);
  const SupportHeights supports = PossibleSupports(landmark.points, *context.supports);
  if (thorough || !landmark.refined) {
    const auto starts = RefinementStarts(landmark, input.points, input.yaw, options);
    return RefineStanding(starts, std::move(input), supports, options.refinement,
                          context.thorough ? SearchEffort::kThorough : SearchEffort::kPromising);
  }
  const std::vector<double> heights = supports.All();
  if (landmark.support && !heights.empty()) {
    input.support_height = *std::min_element(heights.begin(), heights.end(), [&](double a, double b) {
      return std::abs(a - *landmark.support) < std::abs(b - *landmark.support);
    });
  }
  if (!input.support_height && !supports.near.empty()) {
    input.lowest = *std::max_element(supports.near.begin(), supports.near.end());
  }
  const std::optional<double> support = input.support_height;
  const RefinementResult result = RefineJointly(landmark.visible, input, options.refinement);
  return {result.superquadric, support, result.cost, result.covariance};
}

}  // namespace sqslam
