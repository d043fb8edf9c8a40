#include "slam/objects/detection_filter.h"

#include <algorithm>
#include <numeric>

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

// The points of a frame in front of the camera, sorted by image column.
class PointsByColumn {
 public:
  struct Entry {
    double column;  // px
    const TrackedPoint* point;
    double depth;  // map units
  };

  explicit PointsByColumn(const ObjectFrame& frame) {
    const Rigid3d T_camera_map = frame.T_map_camera.Inverse();
    for (const TrackedPoint& point : frame.points) {
      if (const double depth = (T_camera_map * point.p_map).z(); depth > 0.0) {
        entries_.push_back({point.pixel.x(), &point, depth});
      }
    }
    std::ranges::stable_sort(entries_, {}, &Entry::column);
  }

  // Returns the points in the box, in the order of the frame's points.
  std::vector<Entry> In(const Box2d& box) const {
    std::vector<Entry> inside;
    const auto begin = std::ranges::lower_bound(entries_, box.x, {}, &Entry::column);
    for (auto it = begin; it != entries_.end() && it->column <= box.x + box.width; ++it) {
      if (box.Contains(it->point->pixel)) {
        inside.push_back(*it);
      }
    }
    std::ranges::sort(inside, {}, &Entry::point);
    return inside;
  }

 private:
  std::vector<Entry> entries_;
};

void GatherPoints(const PointsByColumn& points, double depth_iqr, BoxCandidate& candidate) {
  const std::vector<PointsByColumn::Entry> inside = points.In(candidate.detection.box);
  const std::vector<double> depths = ToVector(inside, &PointsByColumn::Entry::depth);
  const std::vector<bool> keep = GateDepths(depths, depth_iqr);
  std::vector<double> kept_depths;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < inside.size(); ++i) {
    if (keep[i]) {
      const TrackedPoint& point = *inside[i].point;
      candidate.point_ids.push_back(point.point_id);
      candidate.positions.push_back(point.p_map);
      kept_depths.push_back(depths[i]);
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

constexpr double kTouching = 2.0;  // px; another box this close to an edge probably hides it

// Returns the share of an edge of `box` (0 left, 1 top, 2 right, 3 bottom) that lies inside `other`.
double CoveredShare(const Box2d& box, int edge, const Box2d& other) {
  const bool vertical = edge % 2 == 0;
  const double at = edge == 0   ? box.x
                    : edge == 1 ? box.y
                    : edge == 2 ? box.x + box.width
                                : box.y + box.height;
  const double other_begin = vertical ? other.x : other.y;
  const double other_end = other_begin + (vertical ? other.width : other.height);
  if (at < other_begin - kTouching || at > other_end + kTouching) {
    return 0.0;
  }
  const double begin = vertical ? box.y : box.x;
  const double length = vertical ? box.height : box.width;
  const double cross_begin = vertical ? other.y : other.x;
  const double cross_end = cross_begin + (vertical ? other.height : other.width);
  const double overlap = std::min(begin + length, cross_end) - std::max(begin, cross_begin);
  return length > 0.0 ? std::max(0.0, overlap) / length : 0.0;
}

void MarkHiddenEdges(std::vector<BoxCandidate>& candidates) {
  constexpr double kHidden = 0.25;
  std::vector<int> from_left(candidates.size());
  std::iota(from_left.begin(), from_left.end(), 0);
  const auto left = [&](int i) { return candidates[i].detection.box.x; };
  std::ranges::sort(from_left, {}, left);
  for (BoxCandidate& candidate : candidates) {
    const Box2d& box = candidate.detection.box;
    for (const int i : from_left) {
      const BoxCandidate& other = candidates[i];
      const Box2d& other_box = other.detection.box;
      if (other_box.x > box.x + box.width + kTouching) {
        break;
      }
      if (&other == &candidate || other_box.x + other_box.width < box.x - kTouching ||
          other_box.y > box.y + box.height + kTouching ||
          other_box.y + other_box.height < box.y - kTouching) {
        continue;
      }
      // Objects side by side reach over the same depths: then each may hide the far end of the other. Without
      // depths: of two objects on one support, the nearer one ends lower in the image.
      const bool depths_known = candidate.median_depth > 0.0 && other.median_depth > 0.0;
      const bool reaches_nearer = depths_known ? other.near_depth < candidate.median_depth
                                               : other_box.y + other_box.height > box.y + box.height;
      for (int edge = 0; reaches_nearer && edge < 4; ++edge) {
        // If it also covers the opposite edge, it is rather what this object stands on: a table under a cup.
        const bool covered = CoveredShare(box, edge, other_box) > kHidden;
        const bool through = CoveredShare(box, (edge + 2) % 4, other_box) > kHidden;
        candidate.edge_hidden[edge] = candidate.edge_hidden[edge] || (covered && !through);
      }
    }
  }
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

std::array<bool, 4> CutEdges(const Box2d& box, const Camera& camera, const DetectionFilterOptions& options) {
  const double x_margin = options.border_margin + options.border_share * box.width;
  const double y_margin = options.border_margin + options.border_share * box.height;
  return {box.x <= x_margin, box.y <= y_margin, box.x + box.width >= camera.width - 1.0 - x_margin,
          box.y + box.height >= camera.height - 1.0 - y_margin};
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
  const PointsByColumn points(frame);
  std::vector<BoxCandidate> candidates;
  for (const int index : UsableDetections(frame, options)) {
    BoxCandidate candidate;
    candidate.detection = frame.detections[index];
    candidate.detection_index = index;
    candidate.edge_cut = CutEdges(candidate.detection.box, frame.camera, options);
    GatherPoints(points, depth_iqr, candidate);
    candidates.push_back(std::move(candidate));
  }
  MarkHiddenEdges(candidates);
  return candidates;
}

}  // namespace sqslam
