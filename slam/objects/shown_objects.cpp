#include "slam/objects/shown_objects.h"

#include "slam/geometry/angles.h"
#include "slam/geometry/nearest_solid.h"
#include "slam/objects/landmark_estimation.h"

namespace sqslam {

std::optional<LeftOut> WhyNotShown(const Landmark& landmark, const ObjectOptions& options) {
  if (landmark.moving) {
    return LeftOut::kMoving;
  }
  if (!landmark.known && landmark.Evidence() < options.min_observations) {
    return LeftOut::kFewViews;
  }
  if (!landmark.estimated) {
    return LeftOut::kNoDepth;
  }
  const bool has_points = static_cast<int>(landmark.points.size()) >= options.min_points;
  const double min_agreement = has_points ? options.min_box_agreement : options.pointless_box_agreement;
  const bool agrees = landmark.known || landmark.box_agreement >= min_agreement;
  return agrees ? std::nullopt : std::optional(LeftOut::kContradictingBoxes);
}

std::optional<LeftOut> WhyLeftOut(const Landmark& landmark, const ObjectOptions& options) {
  if (const std::optional<LeftOut> reason = WhyNotShown(landmark, options)) {
    return reason;
  }
  if (!landmark.known && landmark.reliability < options.min_reliability) {
    return LeftOut::kUnreliable;
  }
  const bool unrepresentable = options.representation == Representation::kQuadric && !landmark.quadric;
  return unrepresentable ? std::optional(LeftOut::kNoQuadric) : std::nullopt;
}

std::optional<PosedSuperquadric> Represented(const Landmark& landmark, const ObjectOptions& options) {
  if (WhyLeftOut(landmark, options)) {
    return std::nullopt;
  }
  PosedSuperquadric solid = landmark.superquadric;
  if (options.representation == Representation::kSuperquadric) {
    return solid;
  }
  if (options.representation == Representation::kQuadric) {
    return landmark.quadric;
  }
  const bool round = options.representation == Representation::kEllipsoid;
  const SolidKind kind = round ? SolidKind::kEllipsoid : SolidKind::kCuboid;
  if (!options.keep_size) {
    return NearestOfKind(kind, solid);
  }
  SetExponents(kind, solid.shape.e1, solid.shape.e2);
  return solid;
}

std::optional<SnapshotObject> ShownObject(const Landmark& landmark, const std::optional<Camera>& camera,
                                          const ObjectOptions& options) {
  const std::optional<PosedSuperquadric> solid = Represented(landmark, options);
  if (!solid) {
    return std::nullopt;
  }
  SnapshotObject object;
  object.id = landmark.id;
  object.label = landmark.labels.Best();
  object.score = landmark.labels.BestScore();
  object.observations = landmark.observations;
  object.points = static_cast<int>(landmark.points.size());
  object.superquadric = *solid;
  object.yaw = YawOf(solid->T_map_object.rotation);
  object.fit = {landmark.box_agreement, PointRms(landmark, *solid), landmark.reliability,
                landmark.covariance};
  if (options.representation != Representation::kSuperquadric && camera) {
    const std::vector<BoxView> views = SpreadViews(landmark.views, options.refinement.max_views);
    object.fit.box_agreement = BoxAgreement(*solid, views, *camera);
    object.fit.covariance.setZero();
  }
  return object;
}

}  // namespace sqslam
