// The end of a run: the map is completed, or made afresh if many images lack a place, then every submap gets
// its last adjustment.
#include <algorithm>
#include <ranges>

#include "slam/features/sift_extractor.h"
#include "slam/mapping/feature_database.h"
#include "slam/mapping/mapper.h"
#include "slam/util/parallel.h"
#include "slam/util/to_vector.h"

namespace sqslam {

// Returns all submaps, the one with the most frames first.
std::vector<Submap*> Mapper::RankedSubmaps() {
  std::vector<Submap*> ranked =
      ToVector(submaps_ | std::views::values, [](Submap& submap) { return &submap; });
  std::ranges::stable_sort(
      ranked, [](const Submap* a, const Submap* b) { return a->Frames().size() > b->Frames().size(); });
  return ranked;
}

std::size_t Mapper::FramesInMain() const {
  std::size_t most = 0;
  for (const auto& [number, submap] : submaps_) {
    most = std::max(most, submap.Frames().size());
  }
  return most;
}

// Returns true if the main map holds nearly all images, or if there were too many to map them in another way.
bool Mapper::HasMappedImages() const {
  return !keeps_images_ || static_cast<double>(FramesInMain()) >=
                               options_.mapping.completion.min_mapped * static_cast<double>(images_.size());
}

// Returns the images that can be read again, with features for views that are far apart.
std::vector<LeftoverFrame> Mapper::ImagesWithSift(const std::function<bool()>& stop) const {
  constexpr std::size_t kPart = 8;  // images between two calls of `stop`, which belongs to this thread
  std::vector<LeftoverFrame> images;
  if (outputs_.read_image) {
    images = ToVector(images_ | std::views::values);
  }
  std::erase_if(images, [](const LeftoverFrame& image) { return image.image_path.empty(); });
  const SiftExtractor extractor({});
  for (std::size_t begin = 0; begin < images.size() && !(stop && stop()); begin += kPart) {
    ParallelFor(std::min(kPart, images.size() - begin), 0, [&](std::size_t k) {
      LeftoverFrame& image = images[begin + k];
      const auto extract = [&] {
        const cv::Mat bgr = outputs_.read_image(image.image_path, true);
        return bgr.empty() ? FrameFeatures()
                           : extractor.ExtractRaw(bgr, pose_tracker_.Levels(), image.ignored);
      };
      const bool shared = options_.database && image.ignored.empty();
      const FrameFeaturesPtr raw = shared ? options_.database->FeaturesOf(image.image_path, extract)
                                          : std::make_shared<const FrameFeatures>(extract());
      image.features = std::make_shared<const FrameFeatures>(Undistorted(*raw, camera_));
    });
  }
  return images;
}

// Maps images as photographs, in any order. Keeps that map and returns true if it holds more of them.
bool Mapper::MapAfresh(std::vector<LeftoverFrame> images, const std::function<bool()>& stop) {
  Mapper afresh(camera_, options_, nullptr, {{}, {}, [] { return false; }}, times_, ids_);
  afresh.places_ = places_;
  for (const auto& [number, submap] : submaps_) {
    for (const auto& [id, keyframe] : submap.Map().Keyframes()) {
      afresh.places_.Remove(id);
    }
  }
  for (LeftoverFrame& image : images) {
    afresh.leftovers_.Add(std::move(image));
  }
  afresh.Complete(stop);
  if (afresh.FramesInMain() <= FramesInMain()) {
    return false;
  }
  counters_ = counters_ + afresh.counters_;
  submaps_ = std::move(afresh.submaps_);
  atlas_ = std::move(afresh.atlas_);
  places_ = std::move(afresh.places_);
  loop_edges_ = std::move(afresh.loop_edges_);
  leftovers_ = std::move(afresh.leftovers_);
  placed_ = std::move(afresh.placed_);
  active_ = RankedSubmaps().front();
  for (SnapshotDetection& detection : shown_.detections) {
    detection.object_id = -1;  // of the other map
  }
  return true;
}

// Tracks the boxes of the frames that were placed at the end, in the order of time.
void Mapper::TrackPlacedBoxes() {
  int next_id = 0;
  for (const auto& [number, submap] : submaps_) {
    next_id = std::max(next_id, submap.Objects().View()->IdBound());
  }
  for (Submap* submap : RankedSubmaps()) {
    ObjectTracker tracker(options_.objects);
    tracker.StartIdsAt(next_id);
    for (const auto& [index, frame] : placed_) {
      if (submap->Frames().contains(index) && !frame.detections.empty()) {
        TrackBoxesOf(frame, *submap, tracker);
      }
    }
    next_id = std::max(next_id, tracker.NextId());
  }
}

void Mapper::TrackBoxesOf(const LeftoverFrame& image, Submap& submap, ObjectTracker& tracker) {
  ObjectFrame frame;
  frame.frame_index = image.index;
  frame.T_map_camera = *submap.FramePose(image.index);
  frame.camera = camera_;
  frame.detections = image.detections;
  if (outputs_.read_image) {
    frame.gray = outputs_.read_image(image.image_path, false);
  }
  frame.points = submap.PointsIn(image.index, camera_);
  const std::vector<ObjectObservation> observations = tracker.Track(frame, *submap.Objects().View(), &times_);
  submap.Objects().AddObservations(observations);
  if (image.index == shown_.frame_index) {
    shown_.detections = ToVector(image.detections, [](const Detection& detection) {
      return SnapshotDetection{detection, -1};  // boxes seen before any map began were not recorded
    });
    for (const ObjectObservation& o : observations) {
      shown_.detections[o.detection_index].object_id = o.object_id;
    }
  }
  if (const std::optional<Rigid3d> T_new_old = submap.KeepUpright(camera_, false)) {
    const Sim3d S_new_old = Sim3d::FromRigid(*T_new_old);
    MoveOrigins(submap.Number(), S_new_old, submap.Number());
    tracker.Transform(S_new_old);
  }
  submap.MapObjects(camera_, false);
}

// Runs the final bundle adjustment of the active submap.
void Mapper::OptimizeGlobally(bool with_objects, bool with_frames) {
  const MappingOptions& options = options_.mapping;
  if (active_->Map().Keyframes().size() <= 2) {
    return;
  }
  const std::vector<ObjectTerm> terms =
      with_objects ? active_->ObjectTerms(options.joint_objects) : std::vector<ObjectTerm>();
  const BundleAdjustmentReport report =
      GlobalBundleAdjustment(active_->Map(), camera_, kFinalIterations, {terms, options.joint_objects},
                             active_->FramesBetween(with_frames ? options.final_frames : 0));
  active_->CorrectObjects(report.objects, camera_);
}

void Mapper::FinishSubmap(Submap& submap) {
  active_ = &submap;
  OptimizeGlobally(false, true);
  LearnFrom(submap);
  submap.RefineFrames(camera_, options_.tracking.min_inliers);
  KeepUpright(true);
  submap.MapObjectsLast(camera_);
  if (options_.mapping.joint_objects.Final()) {
    OptimizeGlobally(true, true);
  }
}

// The first submap is the one with the most frames: the others use the camera learnt from it.
void Mapper::LearnFrom(Submap& submap) {
  const CameraLearningOptions& options = options_.mapping.camera;
  if (options.what == LearntPart::kNone || learnt_camera_ || submap.Map().Keyframes().size() <= 2) {
    return;
  }
  learnt_camera_ = LearnCamera(submap.Map(), camera_, options);
  camera_ = learnt_camera_->camera;
}

std::vector<FinishedMap> Mapper::Finish(const std::function<bool()>& stop) {
  const StageTimes::Scope timer(times_, "mapping.final");
  adjustment_.Stop();
  if (active_ != nullptr) {
    TrackBacklog();
  }
  // SIFT takes thirty times as long as the features of tracking, so those get a chance first.
  bool afresh = !HasMappedImages() && MapAfresh(ToVector(images_ | std::views::values), stop);
  if (!HasMappedImages() && !(stop && stop())) {
    afresh = MapAfresh(ImagesWithSift(stop), stop) || afresh;
  }
  if (!afresh) {
    Complete(stop);
  }
  if (submaps_.empty()) {
    return {};
  }
  TrackPlacedBoxes();
  const std::vector<Submap*> ranked = RankedSubmaps();
  std::vector<FinishedMap> finished;
  for (Submap* submap : ranked) {
    const auto keyframes = static_cast<int>(submap->Map().Keyframes().size());
    if (!finished.empty() && keyframes < kMinSubmapKeyframes) {
      ++counters_.resets;
      Drop(submap->Number());
      continue;
    }
    FinishSubmap(*submap);
    finished.push_back({MakeSnapshot(), submap->FrameTrajectory(), submap->KeyframeTrajectory(),
                        finished.empty() ? learnt_camera_ : std::nullopt, submap->Objects().Account()});
  }
  counters_.placed_at_end += static_cast<int>(std::ranges::count_if(
      placed_ | std::views::keys, [this](std::int64_t index) { return HasFrame(index); }));
  Add(seen_boxes_, finished.front().account);
  active_ = ranked.front();
  outputs_.publish_snapshot(finished.front().snapshot);
  return finished;
}

// Drops a submap that never grew.
void Mapper::Drop(std::int64_t submap) {
  for (const auto& [id, keyframe] : submaps_.at(submap).Map().Keyframes()) {
    places_.Remove(id);
    std::erase_if(loop_edges_, [id = id](const auto& edge) { return edge.first == id || edge.second == id; });
  }
  std::erase_if(atlas_.origins, [submap](const auto& origin) { return origin.second.submap == submap; });
  atlas_.submaps.erase(submap);
  submaps_.erase(submap);
}

}  // namespace sqslam
