#include "slam/objects/object_tracker.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>

#include "slam/objects/association.h"
#include "slam/objects/detection_filter.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/line_segments.h"
#include "slam/objects/occlusion.h"
#include "slam/objects/seen_landmark.h"
#include "slam/objects/visibility.h"
#include "slam/objects/yaw.h"

namespace sqslam {
namespace {

std::vector<std::int64_t> SortedIds(const std::vector<TrackedPoint>& points) {
  std::vector<std::int64_t> ids;
  ids.reserve(points.size());
  for (const TrackedPoint& point : points) {
    ids.push_back(point.point_id);
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

}  // namespace

struct ObjectTracker::Impl {
  ObjectOptions options;
  AssociationParts parts;
  int next_id = 0;
  std::map<int, SeenLandmark> tracks;  // by landmark id
  std::int64_t view_version = -1;
  ObjectMapView view;  // the copy that tracks point into
  std::size_t merges_seen = 0;
  std::size_t deleted_seen = 0;
  std::vector<std::int64_t> observed;  // ids of the current frame's points, sorted

  void TakeView(const ObjectMapView& newest);
  std::vector<MeasuredBox> Measure(const ObjectFrame& frame, const std::vector<BoxCandidate>& boxes) const;
  std::vector<KnownLandmark> Known(const ObjectFrame& frame) const;
  void MarkHiddenEdges(const ObjectFrame& frame, const std::vector<int>& ids,
                       std::vector<BoxCandidate>& boxes) const;
  std::vector<int> AssignIds(const ObjectFrame& frame, const std::vector<BoxCandidate>& boxes,
                             const std::vector<MeasuredBox>& measured);
  bool MayStart(const ObjectFrame& frame, const BoxCandidate& box, const std::vector<BoxCandidate>& boxes,
                const std::vector<int>& ids) const;
  void Remember(int id, const ObjectFrame& frame, const BoxCandidate& box, const MeasuredBox& measured);
  ObjectObservation Observe(int id, const ObjectFrame& frame, const BoxCandidate& box,
                            const MeasuredBox& measured) const;
  std::vector<std::int64_t> PointsOutside(const SeenLandmark& track, const ObjectFrame& frame,
                                          const Box2d& box, const std::array<bool, 4>& edge_free) const;
  std::vector<LineSegment> Lines(const ObjectFrame& frame, const std::vector<BoxCandidate>& boxes,
                                 const std::vector<int>& ids) const;
  bool IsLinesTurn(const ObjectFrame& frame, const Box2d& box, int id) const;
  void Transform(const Sim3d& S_new_old);
};

// Follows merges and deletions, and points the tracks at what the mapping thread knows.
void ObjectTracker::Impl::TakeView(const ObjectMapView& newest) {
  if (newest.version == view_version) {
    return;
  }
  view = newest;
  view_version = newest.version;
  for (; merges_seen < view.merges.size(); ++merges_seen) {
    const auto [from, to] = view.merges[merges_seen];
    const auto it = tracks.find(from);
    if (it == tracks.end()) {
      continue;
    }
    SeenLandmark old = std::move(it->second);
    tracks.erase(it);
    tracks[to].Absorb(std::move(old));
  }
  for (; deleted_seen < view.deleted.size(); ++deleted_seen) {
    tracks.erase(view.deleted[deleted_seen]);
  }
  for (auto& [id, track] : tracks) {
    track.view = nullptr;
  }
  for (const ObjectLandmarkView& landmark : view.landmarks) {
    const auto [it, is_new] = tracks.try_emplace(landmark.id);
    SeenLandmark& track = it->second;
    if (is_new) {
      // From a submap that was merged into this one.
      track.labels.Add(landmark.label, 1.0);
      track.observations = landmark.observations;
    }
    track.view = &landmark;
    if (landmark.estimated) {
      // What passed the outlier removal, plus what was seen since; the rest is background.
      track.point_ids.clear();
      track.cloud.clear();
      for (const auto& [point, p] : landmark.points) {
        track.point_ids.insert(point);
        if (parts.rank_sum) {
          track.cloud.push_back(p);
        }
      }
    }
  }
}

std::vector<MeasuredBox> ObjectTracker::Impl::Measure(const ObjectFrame& frame,
                                                      const std::vector<BoxCandidate>& boxes) const {
  std::vector<MeasuredBox> measured;
  for (const BoxCandidate& box : boxes) {
    MeasuredBox m{frame.detections[box.detection_index], {}, box.centroid, {}};
    for (const int point : box.points) {
      m.point_ids.push_back(frame.points[point].point_id);
      if (parts.rank_sum) {
        m.positions.push_back(frame.points[point].p_map);
      }
    }
    measured.push_back(std::move(m));
  }
  return measured;
}

std::vector<KnownLandmark> ObjectTracker::Impl::Known(const ObjectFrame& frame) const {
  std::vector<KnownLandmark> known;
  for (const auto& [id, track] : tracks) {
    KnownLandmark landmark;
    landmark.label = track.labels.Best();
    landmark.frames_since_seen = frame.frame_index - track.last_frame;
    if (landmark.frames_since_seen <= options.association.inter_frame_gap) {
      landmark.predicted_box = track.PredictedBox(frame.frame_index);
    }
    if (track.view && track.view->estimated) {
      const std::optional<Box2d> box =
          parts.projection && MayBeInView(track.view->superquadric, frame.T_map_camera, frame.camera)
              ? ProjectToBox(track.view->superquadric, frame.T_map_camera, frame.camera)
              : std::nullopt;
      if (box) {
        const Box2d clipped = ClipToImage(*box, frame.camera);
        if (clipped.Area() > 0.0) {
          landmark.projected_box = clipped;
        }
      }
      landmark.centre = track.view->centroid;
      landmark.radius = track.view->half_extents.maxCoeff();
    }
    landmark.point_ids = &track.point_ids;
    landmark.centroids = &track.centroids;
    landmark.cloud = &track.cloud;
    known.push_back(landmark);
  }
  return known;
}

// A new landmark needs points, and must not be a second box around something that has one already.
bool ObjectTracker::Impl::MayStart(const ObjectFrame& frame, const BoxCandidate& box,
                                   const std::vector<BoxCandidate>& boxes,
                                   const std::vector<int>& ids) const {
  const Box2d& b = frame.detections[box.detection_index].box;
  const double share = b.Area() / (static_cast<double>(frame.camera.width) * frame.camera.height);
  if (static_cast<int>(box.points.size()) < options.association.min_points ||
      (box.AnyEdgeCut() && share < options.detections.max_cut_share)) {
    return false;
  }
  constexpr double kSameThing = 0.5;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    if (ids[i] >= 0 && IoU(frame.detections[boxes[i].detection_index].box, b) > kSameThing) {
      return false;
    }
  }
  return true;
}

std::vector<int> ObjectTracker::Impl::AssignIds(const ObjectFrame& frame,
                                                const std::vector<BoxCandidate>& boxes,
                                                const std::vector<MeasuredBox>& measured) {
  const std::vector<KnownLandmark> known = Known(frame);
  std::vector<int> ids_of_known;
  for (const auto& [id, track] : tracks) {
    ids_of_known.push_back(id);
  }
  std::vector<int> ids = Associate(measured, known, options.association);
  for (int& id : ids) {
    id = id >= 0 ? ids_of_known[id] : -1;
  }
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    if (ids[i] < 0 && MayStart(frame, boxes[i], boxes, ids)) {
      ids[i] = next_id++;
    }
  }
  return ids;
}

// Edges behind landmarks that are known to stand before the object, whether the detector sees them now or
// not.
void ObjectTracker::Impl::MarkHiddenEdges(const ObjectFrame& frame, const std::vector<int>& ids,
                                          std::vector<BoxCandidate>& boxes) const {
  const Rigid3d T_camera_map = frame.T_map_camera.Inverse();
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const auto own = tracks.find(ids[i]);
    if (own == tracks.end() || !own->second.view || !own->second.view->estimated) {
      continue;
    }
    const ObjectLandmarkView& object = *own->second.view;
    const double depth = (T_camera_map * object.centroid).z();
    const Box2d box = UndistortBox(frame.detections[boxes[i].detection_index].box, frame.camera);
    for (const auto& [id, track] : tracks) {
      if (id == ids[i] || !track.view || !track.view->shown || depth <= 0.0) {
        continue;
      }
      if (!MayHide(track.view->superquadric, object.superquadric)) {
        continue;
      }
      const PosedSuperquadric& other = track.view->superquadric;
      const std::array<bool, 4> hidden = EdgesHiddenBy(box, depth, frame.T_map_camera, frame.camera, other);
      for (std::size_t edge = 0; edge < 4; ++edge) {
        boxes[i].edge_hidden[edge] = boxes[i].edge_hidden[edge] || hidden[edge];
      }
    }
  }
}

void ObjectTracker::Impl::Remember(int id, const ObjectFrame& frame, const BoxCandidate& box,
                                   const MeasuredBox& measured) {
  constexpr std::size_t kMaxPoints = 3000;
  SeenLandmark& track = tracks[id];
  track.labels.Add(measured.detection.label, measured.detection.score);
  track.SeeBox(measured.detection.box, frame.frame_index);
  ++track.observations;
  if (track.point_ids.size() < kMaxPoints) {
    track.point_ids.insert(measured.point_ids.begin(), measured.point_ids.end());
  }
  if (track.cloud.size() < kMaxPoints) {
    track.cloud.insert(track.cloud.end(), measured.positions.begin(), measured.positions.end());
  }
  // The centroid of a part says nothing about the whole.
  if (box.centroid && !box.AnyEdgeCut()) {
    track.centroids.Add(*box.centroid);
  }
}

std::vector<std::int64_t> ObjectTracker::Impl::PointsOutside(const SeenLandmark& track,
                                                             const ObjectFrame& frame, const Box2d& box,
                                                             const std::array<bool, 4>& edge_free) const {
  std::vector<std::int64_t> outside;
  if (!track.view || options.outliers.reprojection == "none") {
    return outside;
  }
  const Rigid3d T_camera_map = frame.T_map_camera.Inverse();
  const double margin = options.outliers.box_margin * std::max(box.width, box.height);
  const bool only_observed = options.outliers.reprojection == "observed";
  for (const auto& [point, p_map] : track.view->points) {
    if (only_observed && !std::binary_search(observed.begin(), observed.end(), point)) {
      continue;
    }
    const Eigen::Vector3d p = T_camera_map * p_map;
    if (p.z() <= 0.0) {
      continue;
    }
    const Eigen::Vector2d pixel = frame.camera.ProjectDistorted(p);
    const bool in_image = pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < frame.camera.width &&
                          pixel.y() < frame.camera.height;
    // Beyond an edge that something else hides the object may well go on.
    if (in_image && IsBeyondEdge(box, edge_free, pixel, margin)) {
      outside.push_back(point);
    }
  }
  return outside;
}

ObjectObservation ObjectTracker::Impl::Observe(int id, const ObjectFrame& frame, const BoxCandidate& box,
                                               const MeasuredBox& measured) const {
  ObjectObservation observation;
  observation.object_id = id;
  observation.frame_index = frame.frame_index;
  observation.detection_index = box.detection_index;
  observation.detection = measured.detection;
  observation.T_map_camera = frame.T_map_camera;
  observation.point_ids = measured.point_ids;
  for (int edge = 0; edge < 4; ++edge) {
    observation.edge_free[edge] = !box.edge_cut[edge] && !box.edge_hidden[edge];
  }
  if (!box.AnyEdgeCut()) {
    observation.centroid = box.centroid;
  }
  observation.reprojected_outside =
      PointsOutside(tracks.at(id), frame, measured.detection.box, observation.edge_free);
  return observation;
}

// Lines cost time: each object's are looked for in every n-th frame, in turn. The lines in the box of a table
// are those of the things on it.
bool ObjectTracker::Impl::IsLinesTurn(const ObjectFrame& frame, const Box2d& box, int id) const {
  const double share = box.Area() / (static_cast<double>(frame.camera.width) * frame.camera.height);
  return id >= 0 && options.yaw.line_interval > 0 &&
         (frame.frame_index + id) % options.yaw.line_interval == 0 && share <= options.yaw.max_box_share;
}

std::vector<LineSegment> ObjectTracker::Impl::Lines(const ObjectFrame& frame,
                                                    const std::vector<BoxCandidate>& boxes,
                                                    const std::vector<int>& ids) const {
  std::vector<Box2d> regions;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Box2d& box = frame.detections[boxes[i].detection_index].box;
    if (IsLinesTurn(frame, box, ids[i])) {
      regions.push_back(box);
    }
  }
  return ExtractLines(frame.gray, frame.camera, regions, options.yaw);
}

void ObjectTracker::Impl::Transform(const Sim3d& S_new_old) {
  for (auto& [id, track] : tracks) {
    track.centroids.Transform(S_new_old);
    for (Eigen::Vector3d& p : track.cloud) {
      p = S_new_old * p;
    }
  }
  for (ObjectLandmarkView& landmark : view.landmarks) {
    landmark.superquadric = S_new_old * landmark.superquadric;
    landmark.half_extents *= S_new_old.scale;
    landmark.centroid = S_new_old * landmark.centroid;
    for (auto& [point, p] : landmark.points) {
      p = S_new_old * p;
    }
  }
}

ObjectTracker::ObjectTracker(const ObjectOptions& options, std::uint64_t) : impl_(new Impl) {
  impl_->options = options;
  impl_->parts = PartsOf(options.association);
}
ObjectTracker::~ObjectTracker() = default;
ObjectTracker::ObjectTracker(ObjectTracker&&) noexcept = default;
ObjectTracker& ObjectTracker::operator=(ObjectTracker&&) noexcept = default;

std::vector<ObjectObservation> ObjectTracker::Track(const ObjectFrame& frame, const ObjectMapView& view,
                                                    StageTimes* times) {
  Impl& impl = *impl_;
  impl.TakeView(view);
  std::vector<BoxCandidate> boxes =
      SelectBoxes(frame, impl.options.detections, impl.options.outliers.depth_iqr);
  const std::vector<MeasuredBox> measured = impl.Measure(frame, boxes);
  const std::vector<int> ids = [&] {
    std::optional<StageTimes::Scope> timer;
    if (times != nullptr) {
      timer.emplace(*times, "tracking.association");
    }
    return impl.AssignIds(frame, boxes, measured);
  }();
  impl.MarkHiddenEdges(frame, ids, boxes);
  const YawOptions& yaw = impl.options.yaw;
  const std::vector<LineSegment> lines = impl.Lines(frame, boxes, ids);
  impl.observed = SortedIds(frame.points);
  std::vector<ObjectObservation> observations;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    if (ids[i] < 0) {
      continue;
    }
    impl.Remember(ids[i], frame, boxes[i], measured[i]);
    ObjectObservation observation = impl.Observe(ids[i], frame, boxes[i], measured[i]);
    if (impl.IsLinesTurn(frame, measured[i].detection.box, ids[i])) {
      observation.lines = LinesInBox(lines, UndistortBox(measured[i].detection.box, frame.camera), yaw);
    }
    if (view.upright && !observation.lines.empty()) {
      const LineView line_view{frame.T_map_camera, observation.lines};
      observation.yaw = YawFromLines({&line_view, 1}, frame.camera, yaw);
    }
    observations.push_back(std::move(observation));
  }
  return observations;
}

void ObjectTracker::StartIdsAt(int id) { impl_->next_id = std::max(impl_->next_id, id); }

int ObjectTracker::NextId() const { return impl_->next_id; }

void ObjectTracker::Transform(const Rigid3d& T_new_old) {
  impl_->Transform({1.0, T_new_old.rotation, T_new_old.translation});
}

void ObjectTracker::Transform(const Sim3d& S_new_old) { impl_->Transform(S_new_old); }

}  // namespace sqslam
