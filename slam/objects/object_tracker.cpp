#include "slam/objects/object_tracker.h"

#include <algorithm>
#include <map>
#include <optional>

#include "slam/objects/association.h"
#include "slam/objects/box_lines.h"
#include "slam/objects/detection_filter.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/paper_method.h"
#include "slam/objects/visibility.h"
#include "slam/objects/yaw.h"
#include "slam/util/to_vector.h"

namespace sqslam {

namespace {

// True if one box is an end of the other, as that of a chair's back: it shares three of its edges. Boxes of
// stacked books share fewer.
bool ArePartAndWhole(const Box2d& a, const Box2d& b) {
  constexpr double kLeast = 0.3;   // IoU
  constexpr double kShared = 0.1;  // distance of shared edges, share of the larger box's width or height
  const std::array<double, 2> tolerance = {kShared * std::max(a.width, b.width),
                                           kShared * std::max(a.height, b.height)};
  int shared = 0;
  for (std::size_t edge = 0; edge < 4; ++edge) {
    shared += std::abs(a.Edges()[edge] - b.Edges()[edge]) < tolerance[edge % 2] ? 1 : 0;
  }
  return shared >= 3 && IoU(a, b) > kLeast;
}

}  // namespace

struct ObjectTracker::Impl {
  ObjectOptions options;
  AssociationParts parts;
  int next_id = 0;
  std::map<int, KnownLandmark> tracks;  // by landmark id
  std::int64_t view_version = -1;
  ObjectMapView view;  // the copy that tracks point into
  std::size_t merges_seen = 0;
  std::size_t deleted_seen = 0;
  std::vector<std::int64_t> observed;  // ids of the current frame's points, sorted
  double line_credit = 0.0;            // px left for line extraction, see YawOptions::line_pixels

  // Applies merges and deletions, and points the tracks at their landmarks in the newest view.
  void TakeView(const ObjectMapView& newest) {
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
      KnownLandmark old = std::move(it->second);
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
      KnownLandmark& track = it->second;
      if (is_new) {
        // From a submap that was merged into this one.
        track.labels.Add(landmark.label, 1.0);
      }
      track.view = &landmark;
      track.centroids = landmark.centroids;  // these follow map corrections; the newest ones come later
      if (landmark.estimated) {
        // Points that passed the outlier removal, plus those seen since; the rest is background.
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

  // Predicts the boxes of the known landmarks in this frame, by their motion in the image and by their
  // superquadrics.
  void PredictBoxes(const ObjectFrame& frame) {
    for (auto& [id, track] : tracks) {
      track.predicted_box.reset();
      track.projected_box.reset();
      if (frame.frame_index - track.last_frame <= options.association.inter_frame_gap) {
        track.predicted_box = track.PredictedBox(frame.frame_index);
      }
      if (parts.projection && track.IsEstimated() &&
          MayBeInView(track.view->visible, frame.T_map_camera, frame.camera)) {
        const auto box =
            ProjectToBox(track.view->visible, track.view->parts, frame.T_map_camera, frame.camera);
        const Box2d clipped = box ? ClipToImage(DistortBox(*box, frame.camera), frame.camera) : Box2d();
        if (clipped.Area() > 0.0) {
          track.projected_box = clipped;
        }
      }
    }
  }

  // True if a known landmark is expected near this box.
  bool IsExpected(const Box2d& box) const {
    constexpr double kAboutThere = 0.2;  // IoU
    return std::ranges::any_of(tracks, [&](const auto& entry) {
      const KnownLandmark& track = entry.second;
      return (track.predicted_box && IoU(*track.predicted_box, box) > kAboutThere) ||
             (track.projected_box && IoU(*track.projected_box, box) > kAboutThere);
    });
  }

  // A new landmark must not be a second box of a known object. Without enough points only the position tells
  // the two apart, so the box must be whole and away from all expected landmarks.
  bool MayStart(const ObjectFrame& frame, const BoxCandidate& box, const std::vector<BoxCandidate>& boxes,
                const std::vector<int>& ids) const {
    const Box2d& b = box.detection.box;
    if (frame.points.empty()) {
      return false;  // the frame's pose is uncertain
    }
    const bool bare = static_cast<int>(box.point_ids.size()) < options.association.min_points;
    if ((bare && (!options.association.start_without_points || box.edges.AnyCut() || IsExpected(b))) ||
        (box.edges.AnyCut() && ShareOfImage(b, frame.camera) < options.detections.max_cut_share)) {
      return false;
    }
    constexpr double kSameThing = 0.5;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const Detection& other = boxes[i].detection;
      const bool same_label = other.label == box.detection.label;
      const bool is_part = options.association.discount_parts && same_label && ArePartAndWhole(other.box, b);
      if (ids[i] >= 0 && (is_part || IoU(other.box, b) > kSameThing)) {
        return false;
      }
    }
    return true;
  }

  std::vector<int> AssignIds(const ObjectFrame& frame, const std::vector<BoxCandidate>& boxes) {
    PredictBoxes(frame);
    std::vector<const KnownLandmark*> known;
    std::vector<int> ids_of_known;
    for (const auto& [id, track] : tracks) {
      known.push_back(&track);
      ids_of_known.push_back(id);
    }
    std::vector<int> ids = Associate(boxes, known, options.association);
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

  // Marks edges hidden by landmarks that stand in front of the object, whether or not these are detected now.
  void MarkHiddenEdges(const ObjectFrame& frame, const std::vector<int>& ids,
                       std::vector<BoxCandidate>& boxes) const {
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const auto own = tracks.find(ids[i]);
      if (own == tracks.end() || !own->second.IsEstimated()) {
        continue;
      }
      const ObjectLandmarkView& seen = *own->second.view;
      for (const auto& [id, track] : tracks) {
        if (id != ids[i] && track.view && track.view->shown &&
            MayOcclude(track.view->superquadric, seen.visible, seen.on_floor)) {
          boxes[i].edges.Hide(EdgesHiddenBy(track.view->superquadric, seen.visible, boxes[i].detection.box,
                                            frame.T_map_camera, frame.camera));
        }
      }
    }
  }

  void Remember(int id, const ObjectFrame& frame, const BoxCandidate& box) {
    constexpr std::size_t kMaxPoints = 3000;
    KnownLandmark& track = tracks[id];
    track.labels.Add(box.detection.label, box.detection.score);
    track.SeeBox(box.detection.box, frame.frame_index);
    if (track.point_ids.size() < kMaxPoints) {
      track.point_ids.insert(box.point_ids.begin(), box.point_ids.end());
    }
    if (parts.rank_sum && track.cloud.size() < kMaxPoints) {
      track.cloud.insert(track.cloud.end(), box.positions.begin(), box.positions.end());
    }
    if (const auto centroid = Centroid(box)) {
      track.centroids.Add(*centroid);
    }
  }

  // The centroid of a part of the object is no measurement of the whole.
  std::optional<Eigen::Vector3d> Centroid(const BoxCandidate& box) const {
    return box.edges.AnyCut() && options.association.discount_parts ? std::nullopt : box.centroid;
  }

  std::vector<std::int64_t> PointsOutside(const KnownLandmark& track, const ObjectFrame& frame,
                                          const Box2d& box, const EdgeFlags& edge_free) const {
    std::vector<std::int64_t> outside;
    if (!track.view || options.outliers.reprojection == ReprojectionVotes::kNone) {
      return outside;
    }
    const Rigid3d T_camera_map = frame.T_map_camera.Inverse();
    const double margin = options.outliers.box_margin * std::max(box.width, box.height);
    const bool only_observed = options.outliers.reprojection == ReprojectionVotes::kObserved;
    // Beyond an edge that is not free the object may continue.
    const EdgeFlags counts =
        options.outliers.newest_box_decides ? EdgeFlags{true, true, true, true} : edge_free;
    for (const auto& [point, p_map] : track.view->points) {
      if (only_observed && !std::ranges::binary_search(observed, point)) {
        continue;
      }
      const Eigen::Vector3d p = T_camera_map * p_map;
      if (p.z() <= 0.0) {
        continue;
      }
      const Eigen::Vector2d pixel = frame.camera.ProjectDistorted(p);
      if (frame.camera.InImage(pixel) && IsBeyondEdge(box, counts, pixel, margin)) {
        outside.push_back(point);
      }
    }
    return outside;
  }

  ObjectObservation Observe(int id, const ObjectFrame& frame, const BoxCandidate& box) const {
    ObjectObservation observation;
    observation.object_id = id;
    observation.frame_index = frame.frame_index;
    observation.detection_index = box.detection_index;
    observation.detection = box.detection;
    if (frame.box_at_once) {
      observation.detection.box = frame.box_at_once(box.detection.box, box.median_depth);
    }
    observation.T_map_camera = frame.T_map_camera;
    observation.point_ids = box.point_ids;
    observation.edge_free = box.edges.Free();
    observation.centroid = Centroid(box);
    if (options.representation == Representation::kQuadric &&
        options.quadric_init == QuadricInit::kSingleView) {
      observation.gray = frame.gray;
    }
    if (const auto track = tracks.find(id); track != tracks.end()) {
      observation.reprojected_outside =
          PointsOutside(track->second, frame, observation.detection.box, observation.edge_free);
    }
    return observation;
  }

  // Extracts lines in some of the boxes; returns the lines of each box, none for the others. To save time
  // objects take turns, those waiting longest first; those with few line views need not wait, except in a
  // crowd. Large boxes are skipped: the lines in the box of a table are those of the things on it.
  std::vector<std::vector<LineSegment>> Lines(const ObjectFrame& frame,
                                              const std::vector<BoxCandidate>& boxes,
                                              const std::vector<int>& ids) {
    const YawOptions& yaw = options.yaw;
    std::vector<std::vector<LineSegment>> lines(boxes.size());
    std::vector<std::pair<std::int64_t, std::size_t>> waiting;  // since which frame, and the box
    for (std::size_t i = 0; i < boxes.size() && yaw.line_interval > 0; ++i) {
      if (ids[i] >= 0 && ShareOfImage(boxes[i].detection.box, frame.camera) <= yaw.max_box_share) {
        KnownLandmark& track = tracks[ids[i]];
        track.lines_frame = track.last_frame < 0 ? frame.frame_index - 1 : track.lines_frame;
        if (frame.frame_index - track.lines_frame >= yaw.line_interval) {
          waiting.emplace_back(track.lines_frame, i);
        }
      }
    }
    std::ranges::sort(waiting);
    constexpr std::size_t kCrowd = 32;  // boxes at once; more would take longer than the rest of tracking
    const bool new_ones_wait = waiting.size() > kCrowd;
    line_credit = std::min(line_credit, 0.0) + yaw.line_pixels;
    std::vector<Box2d> regions;
    std::vector<std::size_t> chosen;
    for (const auto& [since, i] : waiting) {
      KnownLandmark& track = tracks.at(ids[i]);
      const bool may_wait = new_ones_wait || track.line_views >= yaw.line_views;
      if (yaw.line_pixels > 0 && line_credit <= 0.0 && may_wait) {
        continue;
      }
      track.lines_frame = frame.frame_index;
      ++track.line_views;
      line_credit -= LineArea(boxes[i].detection.box, yaw);
      regions.push_back(boxes[i].detection.box);
      chosen.push_back(i);
    }
    const std::vector<LineSegment> found = ExtractLines(frame.gray, frame.camera, regions, yaw);
    for (const std::size_t i : chosen) {
      lines[i] = LinesInBox(found, UndistortBox(boxes[i].detection.box, frame.camera), yaw);
    }
    return lines;
  }
};

ObjectTracker::ObjectTracker(const ObjectOptions& options) : impl_(new Impl) {
  impl_->options = OptionsOfMethod(options);
  impl_->parts = RulesOf(impl_->options.association).parts;
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
  const std::vector<int> ids = [&] {
    std::optional<StageTimes::Scope> timer;
    if (times != nullptr) {
      timer.emplace(*times, "tracking.association");
    }
    return impl.AssignIds(frame, boxes);
  }();
  impl.MarkHiddenEdges(frame, ids, boxes);
  const YawOptions& yaw = impl.options.yaw;
  std::vector<std::vector<LineSegment>> lines = impl.Lines(frame, boxes, ids);
  impl.observed = ToVector(frame.points, &TrackedPoint::point_id);
  std::ranges::sort(impl.observed);
  std::vector<ObjectObservation> observations;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    if (ids[i] >= 0) {
      impl.Remember(ids[i], frame, boxes[i]);
    } else if (frame.points.empty()) {
      continue;  // the frame's pose is uncertain
    }
    ObjectObservation observation = impl.Observe(ids[i], frame, boxes[i]);
    observation.lines = std::move(lines[i]);
    if (view.upright && !observation.lines.empty()) {
      LineView line_view{frame.T_map_camera, observation.lines, {}};
      if (yaw.fit == LineFit::kLeastSquares) {
        line_view.p_axes = boxes[i].centroid;
      }
      observation.yaw = YawFromLines({&line_view, 1}, frame.camera, yaw);
    }
    observations.push_back(std::move(observation));
  }
  return observations;
}

void ObjectTracker::StartIdsAt(int id) { impl_->next_id = std::max(impl_->next_id, id); }

int ObjectTracker::NextId() const { return impl_->next_id; }

void ObjectTracker::Transform(const Sim3d& S_new_old) {
  for (auto& [id, track] : impl_->tracks) {
    track.centroids.Transform(S_new_old);
    for (Eigen::Vector3d& p : track.cloud) {
      p = S_new_old * p;
    }
  }
  for (ObjectLandmarkView& landmark : impl_->view.landmarks) {
    landmark.superquadric = S_new_old * landmark.superquadric;
    landmark.visible = S_new_old * landmark.visible;
    for (auto& [point, p] : landmark.points) {
      p = S_new_old * p;
    }
  }
}

}  // namespace sqslam
