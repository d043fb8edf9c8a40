#include "slam/objects/association.h"

#include <algorithm>
#include <cmath>

#include "slam/objects/assignment.h"
#include "slam/objects/rank_sum.h"

namespace sqslam {
namespace {

double BoxIoU(const std::optional<Box2d>& landmark, const Box2d& box) {
  return landmark ? IoU(*landmark, box) : 0.0;
}

// Gain of an inter-frame association; 0: impossible.
double InterFrameGain(const MeasuredBox& box, const KnownLandmark& landmark, const AssociationParts& parts,
                      const AssociationOptions& options) {
  const bool same_label = box.detection.label == landmark.label;
  if (landmark.frames_since_seen > options.inter_frame_gap || !parts.predicted_box ||
      (!same_label && !parts.other_labels)) {
    return 0.0;
  }
  constexpr double kLeastOverlap = 0.2;  // below, not even all points in common would do
  const double iou = std::max(BoxIoU(landmark.predicted_box, box.detection.box),
                              parts.projection ? BoxIoU(landmark.projected_box, box.detection.box) : 0.0);
  if (iou <= kLeastOverlap) {
    return 0.0;
  }
  const double shared = parts.points ? SharedPoints(box, landmark, options) : 0.0;
  if (!same_label) {
    // A detector that changes its mind about a thing still sees it at the same place.
    const bool same_place = iou >= options.other_label_iou;
    const bool same_points = shared >= options.other_label_shared && iou >= options.min_iou;
    return same_place || same_points ? 0.5 * (iou + shared) : 0.0;
  }
  const bool by_iou = iou >= options.accept_iou || (iou >= options.min_iou && !parts.points);
  const bool by_both = iou >= options.min_iou && (shared >= options.min_shared || box.point_ids.size() <= 6);
  const bool by_points = shared >= 2.0 * options.min_shared;
  return by_iou || by_both || by_points ? iou + shared : 0.0;
}

bool PassesTTest(const MeasuredBox& box, const KnownLandmark& landmark, const AssociationOptions& options) {
  if (!box.centroid || !landmark.centroids || landmark.centroids->count < options.min_t_samples) {
    return false;
  }
  // Centroids of one-sided clouds move with the viewpoint: the spread is at least a tenth of the object.
  const double min_sigma = 0.1 * landmark.radius;
  return IsSampleOf(*landmark.centroids, *box.centroid, options.alpha, min_sigma, OneSampleTest::kOfSingle,
                    options.t_test);
}

bool PassesRankSum(const MeasuredBox& box, const KnownLandmark& landmark, const AssociationOptions& options) {
  const auto enough = static_cast<std::size_t>(options.min_points);
  return landmark.cloud != nullptr && landmark.cloud->size() >= enough && box.positions.size() >= enough &&
         AreSameCloud(box.positions, *landmark.cloud, options.alpha, options.rank_sum_points);
}

// In (0, 1]: which of several landmarks that pass a test the centroid is nearest to.
double Nearness(const MeasuredBox& box, const KnownLandmark& landmark) {
  if (!box.centroid || !landmark.centroids || landmark.centroids->count == 0) {
    return 0.5;
  }
  const double distance = (*box.centroid - landmark.centroids->mean).norm();
  const double spread = std::max(landmark.radius, std::sqrt(landmark.centroids->Variance().sum()));
  return spread > 0.0 ? spread / (spread + distance) : 0.5;
}

bool IsNear(const MeasuredBox& box, const KnownLandmark& landmark, const AssociationOptions& options) {
  return !box.centroid || !landmark.centre || landmark.radius <= 0.0 ||
         (*box.centroid - *landmark.centre).norm() <= (1.0 + options.max_centroid_distance) * landmark.radius;
}

// Gain of an association across a gap; 0: impossible.
double GeometricGain(const MeasuredBox& box, const KnownLandmark& landmark, const AssociationParts& parts,
                     const AssociationOptions& options) {
  const bool same_label = box.detection.label == landmark.label;
  if ((!same_label && !parts.other_labels) || (parts.projection && !IsNear(box, landmark, options))) {
    return 0.0;
  }
  const double iou = parts.projection ? BoxIoU(landmark.projected_box, box.detection.box) : 0.0;
  const double shared = parts.points ? SharedPoints(box, landmark, options) : 0.0;
  if (!same_label) {
    const bool same = iou >= options.other_label_iou || (shared >= options.other_label_shared && iou >= 0.3);
    return same ? 0.5 * (iou + shared) : 0.0;
  }
  const bool projected = parts.projection && landmark.projected_box.has_value();
  const bool by_points = shared >= options.min_shared && (!projected || iou > 0.1);
  const bool by_place = iou >= options.projected_iou_alone;
  const bool same = by_points || by_place || (parts.rank_sum && PassesRankSum(box, landmark, options)) ||
                    (parts.one_sample && (!projected || iou >= options.projected_iou) &&
                     PassesTTest(box, landmark, options));
  return same ? 0.1 * Nearness(box, landmark) + iou + shared : 0.0;
}

}  // namespace

double SharedPoints(const MeasuredBox& box, const KnownLandmark& landmark,
                    const AssociationOptions& options) {
  if (!landmark.point_ids || box.point_ids.empty()) {
    return 0.0;
  }
  const auto shared = std::count_if(box.point_ids.begin(), box.point_ids.end(),
                                    [&](std::int64_t id) { return landmark.point_ids->contains(id); });
  return shared < options.min_shared_points
             ? 0.0
             : static_cast<double>(shared) / static_cast<double>(box.point_ids.size());
}

std::vector<int> Associate(const std::vector<MeasuredBox>& boxes, const std::vector<KnownLandmark>& landmarks,
                           const AssociationOptions& options) {
  const AssociationParts parts = PartsOf(options.method);
  const auto rows = static_cast<Eigen::Index>(boxes.size());
  const auto columns = static_cast<Eigen::Index>(landmarks.size());
  Eigen::MatrixXd gain(rows, columns);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < columns; ++j) {
      gain(i, j) = InterFrameGain(boxes[i], landmarks[j], parts, options);
    }
  }
  std::vector<int> result = AssignOptimally(gain);
  std::vector<bool> taken(landmarks.size(), false);
  for (const int landmark : result) {
    if (landmark >= 0) {
      taken[landmark] = true;
    }
  }
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < columns; ++j) {
      gain(i, j) = result[i] < 0 && !taken[j] ? GeometricGain(boxes[i], landmarks[j], parts, options) : 0.0;
    }
  }
  const std::vector<int> geometric = AssignOptimally(gain);
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = result[i] < 0 ? geometric[i] : result[i];
  }
  return result;
}

}  // namespace sqslam
