#include "slam/objects/landmark_estimation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "slam/objects/isolation_forest.h"
#include "slam/objects/joint_refinement.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/size_shape.h"

namespace sqslam {
namespace {

using NamedPoints = std::vector<std::pair<std::int64_t, Eigen::Vector3d>>;

std::vector<Eigen::Vector3d> Positions(const NamedPoints& points) {
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(points.size());
  for (const auto& [id, p] : points) {
    positions.push_back(p);
  }
  return positions;
}

NamedPoints Keep(const NamedPoints& points, const std::vector<bool>& keep) {
  NamedPoints kept;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (keep[i]) {
      kept.push_back(points[i]);
    }
  }
  return kept;
}

// Looks every voted point up; votes of fused points are added, culled points are forgotten.
NamedPoints ResolvePoints(Landmark& landmark, const PointLookup& lookup, const OutlierOptions& options) {
  std::map<std::int64_t, Landmark::PointVotes> votes;
  std::map<std::int64_t, Eigen::Vector3d> positions;
  for (const auto& [old_id, vote] : landmark.votes) {
    std::int64_t id = old_id;
    if (const std::optional<Eigen::Vector3d> p = lookup(id)) {
      votes[id].inside += vote.inside;
      votes[id].outside += vote.outside;
      votes[id].camera_sum += vote.camera_sum;
      positions[id] = *p;
    }
  }
  landmark.votes = std::move(votes);
  const int min_votes = landmark.views.size() >= 5 ? options.min_votes : 1;
  NamedPoints points;
  for (const auto& [id, vote] : landmark.votes) {
    const double share = static_cast<double>(vote.inside) / std::max(1, vote.inside + vote.outside);
    if (vote.inside >= min_votes && share >= options.min_inside_share) {
      points.emplace_back(id, positions[id]);
    }
  }
  return points;
}

// Reprojection with a vote (section "Reprojection"): a point of the object lies in the object's boxes of all
// views. A single miss may be the detector's, so a share of the views decides.
std::vector<bool> InsideBoxes(const NamedPoints& points, const std::vector<BoxView>& views,
                              const EstimationContext& context) {
  const OutlierOptions& options = context.options->outliers;
  std::vector<int> inside(points.size(), 0);
  std::vector<int> seen(points.size(), 0);
  for (const BoxView& view : views) {
    const Rigid3d T_camera_map = view.T_map_camera.Inverse();
    const double margin = 1.0 + options.box_margin * std::max(view.box.width, view.box.height);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d p = T_camera_map * points[i].second;
      if (p.z() <= 0.0) {
        continue;
      }
      const Eigen::Vector2d pixel = context.camera.ProjectDistorted(p);
      if (pixel.x() < 0.0 || pixel.y() < 0.0 || pixel.x() >= context.camera.width ||
          pixel.y() >= context.camera.height) {
        continue;
      }
      ++seen[i];
      inside[i] += view.box.Contains(pixel, margin) ? 1 : 0;
    }
  }
  std::vector<bool> keep(points.size(), true);
  for (std::size_t i = 0; i < points.size(); ++i) {
    keep[i] = inside[i] >= options.min_inside_share * seen[i];
  }
  return keep;
}

// Points of the support itself lie in every box that looks down on an object. They are dropped where enough
// of the object rises above it.
NamedPoints WithoutSupport(const NamedPoints& points, double support_height) {
  double top = -std::numeric_limits<double>::infinity();
  for (const auto& [id, p] : points) {
    top = std::max(top, p.z());
  }
  const double tolerance = 0.06 * std::max(0.0, top - support_height);
  std::vector<bool> above;
  for (const auto& [id, p] : points) {
    above.push_back(p.z() > support_height + tolerance);
  }
  const auto count = static_cast<std::size_t>(std::count(above.begin(), above.end(), true));
  return 2 * count >= points.size() && count >= 6 ? Keep(points, above) : points;
}

// Points within a smaller object belong to that one: a cup before a screen lies in the screen's box as well.
NamedPoints WithoutSmallerObjects(const NamedPoints& points, const std::vector<PosedSuperquadric>& others) {
  constexpr double kGrown = 1.1;
  std::vector<bool> keep(points.size(), true);
  for (const PosedSuperquadric& other : others) {
    const Rigid3d T_other_map = other.T_map_object.Inverse();
    for (std::size_t i = 0; i < points.size(); ++i) {
      keep[i] = keep[i] && other.shape.RadialScale(T_other_map * points[i].second) > kGrown;
    }
  }
  const auto kept = static_cast<std::size_t>(std::count(keep.begin(), keep.end(), true));
  return 4 * kept >= points.size() ? Keep(points, keep) : points;
}

NamedPoints RemoveOutliers(Landmark& landmark, const std::vector<BoxView>& views,
                           const EstimationContext& context) {
  const ObjectOptions& options = *context.options;
  NamedPoints points = ResolvePoints(landmark, *context.points, options.outliers);
  points = Keep(points, InsideBoxes(points, views, context));
  if (options.method == "refined" && context.upright && context.support_height) {
    points = WithoutSupport(points, *context.support_height);
  }
  if (options.method == "refined") {
    points = WithoutSmallerObjects(points, context.smaller_objects);
  }
  const std::uint64_t seed = context.seed + static_cast<std::uint64_t>(landmark.id) * 7919u;
  return Keep(points, KeepInliers(Positions(points), options.outliers.isolation_forest, seed));
}

std::optional<YawEstimate> YawFromAllLines(const Landmark& landmark, const EstimationContext& context) {
  std::vector<LineView> views;
  for (const auto& [frame, view] : landmark.lines) {
    views.push_back(view);
  }
  return YawFromLines(views, context.camera, context.options->yaw);
}

// The paper's yaw: running mean of the frames' line estimates, otherwise the principal axis, otherwise 0.
std::optional<YawEstimate> PaperYaw(const Landmark& landmark, const std::vector<Eigen::Vector3d>& points,
                                    const EstimationContext& context) {
  if (!landmark.yaw.Empty()) {
    return YawEstimate{landmark.yaw.Mean(), landmark.yaw.Concentration()};
  }
  return YawFromPoints(points, context.options->yaw);
}

// Size and shape at a given yaw (section "Size And Shape").
PosedSuperquadric BoxAtYaw(const std::vector<Eigen::Vector3d>& points, double yaw,
                           const SizeShapeOptions& options, bool with_shape = true) {
  const Eigen::Quaterniond R_map_object(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  std::vector<Eigen::Vector3d> turned;
  turned.reserve(points.size());
  for (const Eigen::Vector3d& p : points) {
    turned.push_back(R_map_object.conjugate() * p);
  }
  const Extents extents = EstimateExtents(turned, options);
  for (Eigen::Vector3d& p : turned) {
    p -= extents.centre;
  }
  const ShapeFit fit = with_shape ? FitShape(turned, extents.half_size, options) : ShapeFit();
  PosedSuperquadric result;
  result.shape = {extents.half_size, fit.e1, fit.e2};
  result.T_map_object = {R_map_object, R_map_object * extents.centre};
  return result;
}

double BoxAgreement(const PosedSuperquadric& superquadric, const std::vector<BoxView>& views,
                    const Camera& camera) {
  double sum = 0.0;
  for (const BoxView& view : views) {
    const std::optional<Box2d> box = ProjectToBox(superquadric, view.T_map_camera, camera);
    sum += box ? IoU(ClipToImage(*box, camera), UndistortBox(view.box, camera)) : 0.0;
  }
  return views.empty() ? 0.0 : sum / static_cast<double>(views.size());
}

// Where the refinement begins: box-like, cylinder-like and ball-like at the yaw of the lines and of the
// cloud, and the last result. A box can't turn into a ball by small steps that each fit better.
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
    starts.push_back(landmark.superquadric);
    yaws.resize(1);
  }
  for (const double yaw : yaws) {
    PosedSuperquadric start = BoxAtYaw(points, yaw, options.size_shape, false);
    const double thin = 0.1 * start.shape.half_size.maxCoeff();  // flat starts can't grow
    start.shape.half_size = start.shape.half_size.cwiseMax(thin);
    for (const auto& [e1, e2] : {std::pair(0.25, 0.25), std::pair(0.25, 1.0), std::pair(1.0, 1.0)}) {
      start.shape.e1 = e1;
      start.shape.e2 = e2;
      starts.push_back(start);
    }
  }
  return starts;
}

PosedSuperquadric Refine(const Landmark& landmark, const std::vector<BoxView>& views,
                         const std::vector<Eigen::Vector3d>& points,
                         const std::optional<YawEstimate>& line_yaw, const EstimationContext& context) {
  const ObjectOptions& options = *context.options;
  RefinementInput input;
  input.points = points;
  for (const auto& [id, p] : landmark.points) {
    const Landmark::PointVotes& vote = landmark.votes.at(id);
    input.point_cameras.push_back(vote.camera_sum / std::max(1, vote.inside));
  }
  input.yaw = line_yaw;
  input.camera = context.camera;
  input.support_height = context.support_height;
  for (const BoxView& view : views) {
    input.views.push_back({view.T_map_camera, UndistortBox(view.box, context.camera), view.edge_free});
  }
  RefinementResult best{landmark.superquadric, std::numeric_limits<double>::infinity()};
  for (const PosedSuperquadric& start : RefinementStarts(landmark, points, line_yaw, options)) {
    const RefinementResult result = RefineJointly(start, input, options.refinement);
    if (result.cost < best.cost) {
      best = result;
    }
  }
  return best.superquadric;
}

}  // namespace

std::vector<BoxView> SpreadViews(const std::vector<BoxView>& views, int count) {
  const std::size_t limit = static_cast<std::size_t>(count);
  if (views.size() <= limit) {
    return views;
  }
  std::vector<double> distances(views.size(), std::numeric_limits<double>::infinity());
  std::vector<std::size_t> chosen;
  std::size_t next = views.size() - 1;
  while (chosen.size() < limit) {
    chosen.push_back(next);
    distances[next] = -1.0;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const double d = (views[i].T_map_camera.translation - views[next].T_map_camera.translation).norm();
      distances[i] = std::min(distances[i], d);
    }
    next = static_cast<std::size_t>(std::max_element(distances.begin(), distances.end()) - distances.begin());
  }
  std::sort(chosen.begin(), chosen.end());
  std::vector<BoxView> result;
  for (const std::size_t i : chosen) {
    result.push_back(views[i]);
  }
  return result;
}

void EstimateLandmark(Landmark& landmark, const EstimationContext& context) {
  constexpr std::size_t kMinPoints = 4;
  const ObjectOptions& options = *context.options;
  const std::vector<BoxView> views = SpreadViews(landmark.views, options.refinement.max_views);
  landmark.points = RemoveOutliers(landmark, views, context);
  landmark.estimated_at = landmark.observations;
  if (landmark.points.size() < kMinPoints) {
    // What the boxes of many views have told stays true when its few points are lost.
    landmark.estimated = landmark.estimated && landmark.refined;
    landmark.box_agreement =
        landmark.estimated ? BoxAgreement(landmark.superquadric, views, context.camera) : 0.0;
    return;
  }
  landmark.estimated = true;
  const std::vector<Eigen::Vector3d> points = Positions(landmark.points);
  const std::optional<YawEstimate> yaw =
      context.upright ? PaperYaw(landmark, points, context) : std::optional<YawEstimate>();
  const double paper_yaw = yaw ? yaw->yaw : 0.0;
  if (options.method == "refined" && context.upright && views.size() >= 5) {
    const PosedSuperquadric refined =
        Refine(landmark, views, points, YawFromAllLines(landmark, context), context);
    // A refinement that runs away explains the boxes worse than the cloud alone.
    const PosedSuperquadric cloud = BoxAtYaw(points, paper_yaw, options.size_shape, false);
    const double agreement = BoxAgreement(refined, views, context.camera);
    if (agreement > 0.9 * BoxAgreement(cloud, views, context.camera)) {
      landmark.superquadric = refined;
      landmark.box_agreement = agreement;
      landmark.refined = true;
      return;
    }
  }
  landmark.superquadric = BoxAtYaw(points, paper_yaw, options.size_shape);
  landmark.box_agreement = BoxAgreement(landmark.superquadric, views, context.camera);
  landmark.refined = false;
}

}  // namespace sqslam
