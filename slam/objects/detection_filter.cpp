#include "slam/objects/detection_filter.h"

#include <algorithm>

#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// Indices of the usable detections without duplicates, in the order of the detections.
std::vector<int> UsableDetections(const ObjectFrame& frame, const DetectionFilterOptions& options) {
  std::vector<int> by_score;
  for (int i = 0; i < static_cast<int>(frame.detections.size()); ++i) {
    if (IsUsable(frame.detections[i], frame.camera, options)) {
      by_score.push_back(i);
    }
  }
  std::ranges::stable_sort(
      by_score, [&](int a, int b) { return frame.detections[a].score > frame.detections[b].score; });
  std::vector<int> kept;
  for (const int i : by_score) {
    const bool is_duplicate = std::ranges::any_of(kept, [&](int j) {
      return IoU(frame.detections[i].box, frame.detections[j].box) > options.duplicate_iou;
    });
    if (!is_duplicate) {
      kept.push_back(i);
    }
  }
  std::ranges::sort(kept);
  return kept;
}

// Gathers the points in the candidate's box that pass the depth gate. `depths`: of the frame's points.
void GatherPoints(const ObjectFrame& frame, const std::vector<double>& depths, double depth_iqr,
                  BoxCandidate& candidate) {
  std::vector<std::size_t> inside;
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    if (depths[i] > 0.0 && candidate.detection.box.Contains(frame.points[i].pixel)) {
      inside.push_back(i);
    }
  }
  const std::vector<bool> keep =
      GateDepths(ToVector(inside, [&](std::size_t i) { return depths[i]; }), depth_iqr);
  std::vector<double> kept_depths;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < inside.size(); ++k) {
    if (keep[k]) {
      const TrackedPoint& point = frame.points[inside[k]];
      candidate.point_ids.push_back(point.point_id);
      candidate.positions.push_back(point.p_map);
      kept_depths.push_back(depths[inside[k]]);
      sum += point.p_map;
    }
  }
  if (kept_depths.empty()) {
    return;
  }
  if (kept_depths.size() >= 3) {
    candidate.centroid = sum / static_cast<double>(kept_depths.size());
  }
  candidate.near_depth = LinearQuantile(kept_depths, 0.25);
  candidate.median_depth = UpperMedian(std::move(kept_depths));
}

}  // namespace

bool IsUsable(const Detection& detection, const Camera& camera, const DetectionFilterOptions& options) {
  const auto& ignored = options.ignored_labels;
  if (detection.score < options.min_score || std::ranges::find(ignored, detection.label) != ignored.end()) {
    return false;
  }
  const double share = ShareOfImage(detection.box, camera);
  return share >= options.min_box_share && share <= options.max_box_share;
}

double ShareOfImage(const Box2d& box, const Camera& camera) {
  return box.Area() / (static_cast<double>(camera.width) * camera.height);
}

std::vector<bool> GateDepths(const std::vector<double>& depths, double iqr_factor) {
  std::vector<bool> keep(depths.size(), true);
  if (depths.size() < 4 || iqr_factor <= 0.0) {
    return keep;
  }
  const double q1 = LinearQuantile(depths, 0.25);
  const double q3 = LinearQuantile(depths, 0.75);
  const double reach = iqr_factor * (q3 - q1);
  for (std::size_t i = 0; i < depths.size(); ++i) {
    keep[i] = depths[i] >= q1 - reach && depths[i] <= q3 + reach;
  }
  return keep;
}

std::vector<BoxCandidate> SelectBoxes(const ObjectFrame& frame, const DetectionFilterOptions& options,
                                      double depth_iqr) {
  const Rigid3d T_camera_map = frame.T_map_camera.Inverse();
  const std::vector<double> depths =
      ToVector(frame.points, [&](const TrackedPoint& point) { return (T_camera_map * point.p_map).z(); });
  std::vector<BoxCandidate> candidates;
  for (const int index : UsableDetections(frame, options)) {
    BoxCandidate candidate;
    candidate.detection = frame.detections[index];
    candidate.detection_index = index;
    candidate.edges.cut = CutEdges(candidate.detection.box, frame.camera, options);
    GatherPoints(frame, depths, depth_iqr, candidate);
    candidates.push_back(std::move(candidate));
  }
  const std::vector<EdgeFlags> hidden = EdgesHiddenByBoxes(ToVector(candidates, [](const BoxCandidate& c) {
    return BoxAtDepth{c.detection.box, c.median_depth, c.near_depth};
  }));
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    candidates[i].edges.hidden = hidden[i];
  }
  return candidates;
}

}  // namespace sqslam
