#include "slam/objects/landmark_estimation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <ranges>
#include <tuple>
#include <utility>

#include "slam/objects/landmark_geometry.h"
#include "slam/objects/landmark_outliers.h"
#include "slam/objects/landmark_refinement.h"
#include "slam/objects/reliability.h"
#include "slam/objects/size_shape.h"
#include "slam/objects/surroundings.h"
#include "slam/objects/visibility.h"
#include "slam/util/statistics.h"
#include "slam/util/thinned.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// The paper's yaw: running mean of the frames' line estimates, otherwise the principal axis, otherwise 0.
std::optional<YawEstimate> PaperYaw(const Landmark& landmark, const std::vector<Eigen::Vector3d>& points,
                                    const EstimationContext& context) {
  if (!landmark.yaw.Empty()) {
    return YawEstimate{landmark.yaw.Mean(), landmark.yaw.Concentration()};
  }
  return YawFromPoints(points, context.options->yaw);
}

// Stretches an object whose lower part is hidden, as behind a table, down to the support of what hides it,
// unless its own support is known.
void CompleteHiddenPart(Landmark& landmark, const std::vector<BoxView>& views,
                        const EstimationContext& context) {
  const PosedSuperquadric& seen = landmark.visible;
  const std::optional<double>& support = context.surroundings.hidden_support;
  const double bottom = seen.T_map_object.translation.z() - seen.shape.half_size.z();
  if (!landmark.support && support && *support < bottom && !IsBottomSeen(views)) {
    landmark.superquadric = StretchedTo(seen, *support);
    landmark.support = support;
  }
}

// Extent along an axis of an object, from its centre.
struct Span {
  double low = 0.0;
  double high = 0.0;

  double Half() const { return 0.5 * (high - low); }
};

// Returns the extent along a horizontal axis in which most of the object's points lie, within its own.
Span SeenAlong(const Landmark& landmark, Eigen::Index axis) {
  constexpr std::size_t kMinPoints = 10;
  constexpr double kStray = 0.05;      // share of the points at either end
  constexpr double kThinnest = 0.005;  // of the size
  const auto& [shape, T_map_object] = landmark.superquadric;
  const double half = shape.half_size[axis];
  if (landmark.points.size() < kMinPoints) {
    return {-half, half};
  }
  const Rigid3d T_object_map = T_map_object.Inverse();
  const std::vector<double> along =
      ToVector(landmark.points | std::views::values,
               [&](const Eigen::Vector3d& p) { return (T_object_map * p)[axis]; });
  const double least = kThinnest * shape.half_size.norm();
  const double low = std::clamp(LinearQuantile(along, kStray), -half, half - 2.0 * least);
  return {low, std::clamp(LinearQuantile(along, 1.0 - kStray), low + 2.0 * least, half)};
}

// Gives an object the depth of its class if far less of it was seen: of a chair pushed under a table only the
// back is seen, and the seat reaches towards the table. The covariance tells how well classes know depths.
void CompleteHiddenDepth(Landmark& landmark, const std::vector<BoxView>& views,
                         const EstimationContext& context) {
  constexpr double kFarThinner = 2.0;  // standard deviations
  constexpr double kUnusual = 7.8;     // chi square of three terms that one in twenty exceeds
  const ObjectClass& known = context.classes->Of(landmark.labels.Best());
  if (!known.hollow || IsBottomSeen(views)) {
    return;
  }
  Superquadric completed = landmark.superquadric.shape;
  const std::array<Span, 2> spans = {SeenAlong(landmark, 0), SeenAlong(landmark, 1)};
  const Eigen::Index thin = spans[0].Half() < spans[1].Half() ? 0 : 1;
  const Span& seen = spans[static_cast<std::size_t>(thin)];
  const double usual = completed.half_size[1 - thin] * std::exp(-known.log_width_ratio);
  completed.half_size[thin] = usual;
  if (std::log(usual / seen.Half()) < kFarThinner * known.width_sigma ||
      ClassSurprise(completed, known, context.scale) > kUnusual) {
    return;
  }
  const PosedSuperquadric* occluder =
      OccluderOfBottom(landmark, known.on_floor, context.surroundings.others, views, context.camera);
  if (occluder == nullptr) {
    return;
  }
  landmark.superquadric.shape = completed;
  const Eigen::Vector3d axis = landmark.superquadric.T_map_object.rotation * Eigen::Vector3d::Unit(thin);
  const bool along =
      axis.dot(DirectionToTableAxis(*occluder, landmark.superquadric.T_map_object.translation)) > 0.0;
  const double middle = along ? seen.low + usual : seen.high - usual;
  landmark.superquadric.T_map_object.translation += middle * axis;
  Eigen::Matrix<double, 9, 1> effect = Eigen::Matrix<double, 9, 1>::Zero();
  effect.head<3>() = along ? axis : -axis;
  effect[3 + thin] = 1.0;
  effect *= known.width_sigma * usual;
  landmark.covariance += effect * effect.transpose();
}

void JudgeHiddenEdges(const Landmark& landmark, const EstimationContext& context,
                      std::vector<BoxView>& views) {
  const Surroundings& near = context.surroundings;
  JudgeHiddenEdges(landmark.visible, near.beneath, near.occluders, context.camera,
                   context.options->detections, views);
}

constexpr std::size_t kMinViews = 3;  // that a refinement needs

// Returns as many evenly spaced views that are not among `used`; `used` itself if there are hardly any.
std::vector<BoxView> HeldOutViews(const std::vector<BoxView>& all, const std::vector<BoxView>& used) {
  constexpr std::size_t kMinOthers = 5;
  std::vector<BoxView> others;
  std::ranges::copy_if(all, std::back_inserter(others), [&](const BoxView& view) {
    return std::ranges::find(used, view.frame_index, &BoxView::frame_index) == used.end();
  });
  return others.size() < kMinOthers ? used : Thinned(others, used.size());
}

// Updates the landmark's reliability; `used`: the views of its estimate.
void JudgeReliability(Landmark& landmark, const std::vector<BoxView>& used,
                      const EstimationContext& context) {
  constexpr double kUnknownSigma = 0.25;  // of sizes without a covariance
  std::vector<BoxView> held_out = HeldOutViews(landmark.views, used);
  JudgeHiddenEdges(landmark, context, held_out);
  const Superquadric& shape = landmark.superquadric.shape;
  ReliabilityEvidence evidence;
  evidence.observations = landmark.Evidence();
  evidence.held_out_agreement = BoxAgreement(landmark.visible, landmark.parts, held_out, context.camera);
  if (context.options->refinement.enabled) {
    evidence.log_size_sigma = landmark.refined ? LogSizeSigma(shape, landmark.covariance) : kUnknownSigma;
    evidence.class_surprise =
        ClassSurprise(shape, context.classes->Of(landmark.labels.Best()), context.scale);
  }
  landmark.reliability = Reliability(evidence);
}

// True each time the evidence has doubled: small steps do not leave the minimum of a wrong start.
bool IsThoroughNow(Landmark& landmark, const EstimationContext& context) {
  const bool thorough = context.thorough || landmark.observations >= 2 * landmark.thorough_at;
  landmark.thorough_at = thorough ? landmark.observations : landmark.thorough_at;
  return thorough;
}

// True if the solid lies for the most part, and surely, below the floor.
bool IsBelowFloor(const StandingFit& fit, const SupportSurfaces& supports) {
  constexpr double kSure = 2.0;  // standard deviations
  const double highest =
      fit.superquadric.T_map_object.translation.z() + kSure * std::sqrt(fit.covariance(2, 2));
  return fit.placed && supports.Floor() && highest < *supports.Floor();
}

// True if no solid at rest explains the boxes: one that moves by more than its own size fits them far better,
// or, of an object without points on it, the solid at rest lies below the floor. A car ahead that is as fast
// as the camera has the boxes of a huge one far away, which reaches below the road.
bool IsMoving(const Landmark& landmark, const StandingFit& fit, const EstimationContext& context) {
  constexpr double kMinGain = 20.0;  // far above chance, as the errors of boxes repeat from view to view
  constexpr double kByPoint = 1.0;   // more for each point at rest, which a moving thing has by chance only
  if (landmark.observations < context.options->min_observations) {
    return false;
  }
  const double size = 2.0 / std::sqrt(3.0) * fit.motion.superquadric.shape.half_size.norm();
  const double min_gain = kMinGain + kByPoint * static_cast<double>(landmark.points.size());
  return (fit.motion.gain > min_gain && fit.motion.displacement.norm() > size) ||
         (landmark.points.size() < kMinPoints && IsBelowFloor(fit, *context.supports));
}

// Takes the estimate from a landmark that moves. Returns true if it moves.
bool RejectMoving(const StandingFit& fit, const EstimationContext& context, Landmark& landmark) {
  landmark.moving = IsMoving(landmark, fit, context);
  if (landmark.moving) {
    landmark.estimated = false;
    landmark.refined = false;
    landmark.box_agreement = 0.0;
    landmark.reliability = 0.0;
  }
  return landmark.moving;
}

// Estimates an object with too few points from its boxes and its support, if these determine its size.
// Otherwise keeps an earlier refined estimate.
void EstimateFromBoxes(Landmark& landmark, const std::vector<BoxView>& views,
                       const EstimationContext& context) {
  constexpr double kKnownSize = 0.2;  // standard deviation of the logarithm
  if (context.options->refinement.enabled && context.upright && views.size() >= kMinViews) {
    const std::optional<StandingFit> fit =
        RefineLandmark(landmark, views, IsThoroughNow(landmark, context), context);
    if (fit && RejectMoving(*fit, context, landmark)) {
      return;
    }
    if (fit && fit->placed && LogSizeSigma(fit->superquadric.shape, fit->covariance) < kKnownSize) {
      landmark.estimated = true;
      ApplyFit(landmark, *fit, views, context);
      return;
    }
  }
  landmark.estimated = landmark.estimated && landmark.refined;
  landmark.box_agreement =
      landmark.estimated ? BoxAgreement(landmark.visible, landmark.parts, views, context.camera) : 0.0;
}

}  // namespace

void ApplyFit(Landmark& landmark, const StandingFit& fit, const std::vector<BoxView>& views,
              const EstimationContext& context) {
  landmark.visible = fit.superquadric;
  landmark.superquadric = fit.superquadric;
  landmark.parts = fit.parts;
  landmark.support = fit.assumption.support;
  landmark.covariance = fit.covariance;
  CompleteHiddenPart(landmark, views, context);
  CompleteHiddenDepth(landmark, views, context);
  landmark.box_agreement = BoxAgreement(fit.superquadric, fit.parts, views, context.camera);
  landmark.refined = true;
  JudgeReliability(landmark, views, context);
}

double BoxAgreement(const PosedSuperquadric& hull, const std::vector<SolidPart>& parts,
                    const std::vector<BoxView>& views, const Camera& camera) {
  double sum = 0.0;
  for (const BoxView& view : views) {
    const std::optional<Box2d> box = ProjectToBox(hull, parts, view.T_map_camera, camera);
    if (!box) {
      continue;
    }
    const Box2d projected = ClipToShown(*box, camera);
    sum += IoU(projected, Continued(UndistortBox(view.box, camera), view.edge_free, projected));
  }
  return views.empty() ? 0.0 : sum / static_cast<double>(views.size());
}

double BoxAgreement(const PosedSuperquadric& superquadric, const std::vector<BoxView>& views,
                    const Camera& camera) {
  return BoxAgreement(superquadric, {}, views, camera);
}

double PointRms(const Landmark& landmark, const PosedSuperquadric& solid) {
  const Rigid3d T_object_map = solid.T_map_object.Inverse();
  double sum = 0.0;
  for (const auto& [id, p] : landmark.points) {
    const double distance = solid.shape.RadialDistance(T_object_map * p);
    sum += distance * distance;
  }
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, landmark.points.size())));
}

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
    next = static_cast<std::size_t>(std::ranges::max_element(distances) - distances.begin());
  }
  std::ranges::sort(chosen);
  return ToVector(chosen, [&](const std::size_t i) { return views[i]; });
}

void EstimateLandmark(Landmark& landmark, const EstimationContext& context) {
  const ObjectOptions& options = *context.options;
  std::vector<BoxView> views = SpreadViews(landmark.views, options.refinement.max_views);
  if (landmark.estimated) {
    JudgeHiddenEdges(landmark, context, views);
  }
  landmark.points = RemoveOutliers(landmark, views, context);
  landmark.estimated_at = landmark.observations;
  landmark.moving = false;
  if (landmark.points.size() < kMinPoints) {
    EstimateFromBoxes(landmark, views, context);
    return;
  }
  landmark.estimated = true;
  const std::vector<Eigen::Vector3d> points = Positions(landmark.points);
  const std::optional<YawEstimate> yaw =
      context.upright ? PaperYaw(landmark, points, context) : std::optional<YawEstimate>();
  const double paper_yaw = yaw ? yaw->yaw : 0.0;
  if (options.refinement.enabled && context.upright && views.size() >= kMinViews) {
    const StandingFit refined = *RefineLandmark(landmark, views, IsThoroughNow(landmark, context), context);
    if (RejectMoving(refined, context, landmark)) {
      return;
    }
    // A diverged refinement explains the boxes worse than the cloud alone.
    const PosedSuperquadric cloud = SuperquadricAtYaw(points, paper_yaw, options.size_shape, false);
    const double agreement = BoxAgreement(refined.superquadric, refined.parts, views, context.camera);
    if (agreement > 0.9 * BoxAgreement(cloud, views, context.camera)) {
      ApplyFit(landmark, refined, views, context);
      return;
    }
  }
  landmark.support.reset();
  // The shape of a young object is left to its first refinement.
  const bool with_shape = !options.refinement.enabled || views.size() >= kMinViews;
  landmark.superquadric = SuperquadricAtYaw(points, paper_yaw, options.size_shape, with_shape);
  landmark.visible = landmark.superquadric;
  landmark.parts.clear();
  landmark.covariance.setZero();
  landmark.box_agreement = BoxAgreement(landmark.superquadric, views, context.camera);
  landmark.refined = false;
  JudgeReliability(landmark, views, context);
}

std::vector<int> MostOutdated(const std::map<int, Landmark>& landmarks, int most) {
  constexpr double kOutdated = 1.0 / 6.0;
  std::vector<std::tuple<bool, double, int>> outdated;  // those never estimated first, with most boxes
  for (const auto& [id, landmark] : landmarks) {
    const double since = landmark.observations - landmark.estimated_at;
    if (landmark.estimated_at == 0) {
      outdated.emplace_back(false, -since, id);
    } else if (since >= kOutdated * landmark.estimated_at) {
      outdated.emplace_back(true, -since / landmark.estimated_at, id);
    }
  }
  std::ranges::sort(outdated);
  std::vector<int> ids = ToVector(outdated | std::views::elements<2>);
  if (most > 0 && ids.size() > static_cast<std::size_t>(most)) {
    ids.resize(static_cast<std::size_t>(most));
  }
  return ids;
}

std::vector<int> LargestFirst(const std::map<int, Landmark>& landmarks, const std::vector<int>& ids,
                              const ClassTable& classes, const std::optional<MetricScale>& scale) {
  std::vector<std::pair<double, int>> by_size;
  for (const int id : ids) {
    const Landmark& landmark = landmarks.at(id);
    const std::optional<double>& log_metres = classes.Of(landmark.labels.Best()).log_metres;
    const double mapped = 2.0 / std::sqrt(3.0) * landmark.superquadric.shape.half_size.norm();
    const double size = log_metres && scale ? std::exp(*log_metres - scale->log_scale) : mapped;
    by_size.emplace_back(landmark.estimated ? -size : 0.0, id);
  }
  std::ranges::sort(by_size);
  return ToVector(by_size | std::views::values);
}

}  // namespace sqslam
