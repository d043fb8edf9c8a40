#include "slam/objects/association.h"

#include <algorithm>
#include <cmath>

#include "slam/objects/assignment.h"
#include "slam/objects/statistical_tests.h"

namespace sqslam {
namespace {

double BoxIoU(const std::optional<Box2d>& landmark, const Box2d& box) {
  return landmark ? IoU(*landmark, box) : 0.0;
}

// Share of the box's points that are the landmark's, in [0, 1]; 0 below options.min_shared_points.
double SharedPoints(const BoxCandidate& box, const KnownLandmark& landmark,
                    const AssociationOptions& options) {
  if (box.point_ids.empty()) {
    return 0.0;
  }
  const auto shared =
      std::ranges::count_if(box.point_ids, [&](std::int64_t id) { return landmark.point_ids.contains(id); });
  return shared < options.min_shared_points
             ? 0.0
             : static_cast<double>(shared) / static_cast<double>(box.point_ids.size());
}

// Gain of an inter-frame association; 0: impossible.
double InterFrameGain(const BoxCandidate& box, const KnownLandmark& landmark, const AssociationRules& rules,
                      const AssociationOptions& options) {
  const AssociationParts& parts = rules.parts;
  if (!landmark.predicted_box || !parts.predicted_box) {
    return 0.0;
  }
  constexpr double kLeastOverlap = 0.2;  // below, even sharing all points is not enough
  const Box2d& last = rules.still ? landmark.last_box : *landmark.predicted_box;
  const double iou = std::max(IoU(last, box.detection.box),
                              parts.projection ? BoxIoU(landmark.projected_box, box.detection.box) : 0.0);
  if (iou <= kLeastOverlap) {
    return 0.0;
  }
  const bool same_label = box.detection.label == landmark.labels.Best();
  if (!same_label && !parts.other_labels) {
    return 0.0;
  }
  const double shared = parts.points ? SharedPoints(box, landmark, options) : 0.0;
  if (!same_label) {
    // If the detector changes the label, the object is still at the same place.
    const bool same_place = iou >= options.other_label_iou;
    const bool same_points = shared >= options.other_label_shared && iou >= options.min_iou;
    return same_place || same_points ? 0.5 * (iou + shared) : 0.0;
  }
  const bool by_iou = iou >= options.accept_iou || (iou >= options.min_iou && !parts.points);
  const bool by_both = iou >= options.min_iou && shared >= options.min_shared;
  const bool by_points = shared >= 2.0 * options.min_shared;
  return by_iou || by_both || by_points ? iou + shared : 0.0;
}

bool PassesTTest(const BoxCandidate& box, const KnownLandmark& landmark, const AssociationRules& rules,
                 const AssociationOptions& options) {
  if (!box.centroid || landmark.centroids.count < options.min_t_samples) {
    return false;
  }
  // Centroids of one-sided clouds move with the viewpoint, so their spread has a lower bound.
  return IsSampleOf(landmark.centroids, *box.centroid, options.alpha, rules.least_spread * landmark.Radius(),
                    rules.one_sample);
}

bool PassesRankSum(const BoxCandidate& box, const KnownLandmark& landmark,
                   const AssociationOptions& options) {
  const auto enough = static_cast<std::size_t>(options.min_points);
  return landmark.cloud.size() >= enough && box.positions.size() >= enough &&
         AreSameCloud(box.positions, landmark.cloud, options.alpha, options.rank_sum_points);
}

// Ranks landmarks that pass a test by their distance from the centroid, in (0, 1].
double Nearness(const BoxCandidate& box, const KnownLandmark& landmark) {
  if (!box.centroid || landmark.centroids.count == 0) {
    return 0.5;
  }
  const double distance = (*box.centroid - landmark.centroids.mean).norm();
  const double spread = std::max(landmark.Radius(), std::sqrt(landmark.centroids.Variance().sum()));
  return spread > 0.0 ? spread / (spread + distance) : 0.5;
}

bool IsNear(const BoxCandidate& box, const KnownLandmark& landmark, const AssociationOptions& options) {
  const double radius = landmark.Radius();
  return !box.centroid || radius <= 0.0 ||
         (*box.centroid - landmark.view->visible.T_map_object.translation).norm() <=
             (1.0 + options.max_centroid_distance) * radius;
}

// Gain of an association across a gap; 0: impossible.
double GeometricGain(const BoxCandidate& box, const KnownLandmark& landmark, const AssociationRules& rules,
                     const AssociationOptions& options) {
  const AssociationParts& parts = rules.parts;
  const bool same_label = box.detection.label == landmark.labels.Best();
  if ((!same_label && !parts.other_labels) || (parts.projection && !IsNear(box, landmark, options))) {
    return 0.0;
  }
  const double iou = parts.projection ? BoxIoU(landmark.projected_box, box.detection.box) : 0.0;
  const double shared = parts.points && rules.points_later ? SharedPoints(box, landmark, options) : 0.0;
  if (!same_label) {
    const bool same = iou >= options.other_label_iou || (shared >= options.other_label_shared && iou >= 0.3);
    return same ? 0.5 * (iou + shared) : 0.0;
  }
  const bool projected = parts.projection && landmark.projected_box.has_value();
  const bool by_points = shared >= options.min_shared && (!projected || iou > 0.1);
  const bool by_place = iou >= options.projected_iou_alone;
  const bool same = by_points || by_place || (parts.rank_sum && PassesRankSum(box, landmark, options)) ||
                    (parts.one_sample && (!projected || iou >= options.projected_iou) &&
                     PassesTTest(box, landmark, rules, options));
  return same ? 0.1 * Nearness(box, landmark) + iou + shared : 0.0;
}

}  // namespace

AssociationRules RulesOf(const AssociationOptions& options) {
  return options.rules.value_or(AssociationRules{.parts = PartsOf(options.method)});
}

std::vector<int> Associate(const std::vector<BoxCandidate>& boxes,
                           const std::vector<const KnownLandmark*>& landmarks,
                           const AssociationOptions& options) {
  const AssociationRules rules = RulesOf(options);
  const auto assign = [&](const auto& gain_of) {
    return AssignOptimally(Eigen::MatrixXd::NullaryExpr(
        static_cast<Eigen::Index>(boxes.size()), static_cast<Eigen::Index>(landmarks.size()), gain_of));
  };
  std::vector<int> result = assign([&](Eigen::Index i, Eigen::Index j) {
    return InterFrameGain(boxes[i], *landmarks[j], rules, options);
  });
  const std::vector<int> geometric = assign([&](Eigen::Index i, Eigen::Index j) {
    const bool are_free = result[i] < 0 && std::ranges::find(result, j) == result.end();
    return are_free ? GeometricGain(boxes[i], *landmarks[j], rules, options) : 0.0;
  });
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = result[i] < 0 ? geometric[i] : result[i];
  }
  return result;
}

double KnownLandmark::Radius() const {
  return IsEstimated() ? view->visible.shape.half_size.maxCoeff() : 0.0;
}

Box2d KnownLandmark::PredictedBox(std::int64_t frame_index) const {
  const auto frames = static_cast<double>(frame_index - last_frame);
  return {last_box.x + frames * box_velocity.x, last_box.y + frames * box_velocity.y,
          std::max(1.0, last_box.width + frames * box_velocity.width),
          std::max(1.0, last_box.height + frames * box_velocity.height)};
}

void KnownLandmark::SeeBox(const Box2d& box, std::int64_t frame_index) {
  const std::int64_t frames = frame_index - last_frame;
  constexpr std::int64_t kMaxGap = 3;
  if (last_frame >= 0 && frames <= kMaxGap && frames > 0) {
    // Half the measured motion: boxes of a detector jitter, and a full step would amplify that.
    const double f = 0.5 / static_cast<double>(frames);
    box_velocity = {f * (box.Center().x() - last_box.Center().x()),
                    f * (box.Center().y() - last_box.Center().y()), 0.0, 0.0};
  } else {
    box_velocity = {};
  }
  last_box = box;
  last_frame = frame_index;
}

void KnownLandmark::Absorb(KnownLandmark&& other) {
  labels.Merge(other.labels);
  centroids.Merge(other.centroids);
  point_ids.merge(other.point_ids);
  cloud.insert(cloud.end(), other.cloud.begin(), other.cloud.end());
  lines_frame = std::max(lines_frame, other.lines_frame);
  line_views += other.line_views;
  if (other.last_frame > last_frame) {
    last_frame = other.last_frame;
    last_box = other.last_box;
    box_velocity = other.box_velocity;
  }
}

}  // namespace sqslam
