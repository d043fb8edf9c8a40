#include "slam/evaluation/error_budget.h"

#include <algorithm>
#include <map>
#include <opencv2/imgproc.hpp>
#include <ranges>
#include <tuple>
#include <utility>

#include "slam/geometry/angles.h"
#include "slam/io/input_images.h"
#include "slam/objects/box_lines.h"
#include "slam/objects/detection_filter.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/landmark_refinement.h"
#include "slam/objects/recorded_landmarks.h"
#include "slam/objects/yaw.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// A recorded frame with a pose.
struct BudgetFrame {
  std::int64_t index = 0;
  Rigid3d T_map_camera;
  std::optional<Rigid3d> true_T_map_camera;
  std::vector<BoxCandidate> boxes;
  std::vector<LineSegment> lines;
};

Rigid3d TruePose(const BudgetFrame& frame) { return frame.true_T_map_camera.value_or(frame.T_map_camera); }

// Returns null if there is none.
const BudgetFrame* FrameWith(std::int64_t index, const std::vector<BudgetFrame>& frames) {
  const auto it = std::ranges::lower_bound(frames, index, {}, &BudgetFrame::index);
  return it != frames.end() && it->index == index ? &*it : nullptr;
}

LineView LinesOfBox(const BudgetFrame& frame, const Box2d& box, const Camera& camera,
                    const YawOptions& options) {
  return {frame.T_map_camera, ShareOfImage(box, camera) > options.max_box_share
                                  ? std::vector<LineSegment>()
                                  : LinesInBox(frame.lines, UndistortBox(box, camera), options)};
}

std::optional<Box2d> ShownBox(const PosedSuperquadric& solid, const Rigid3d& T_map_camera,
                              const Camera& camera) {
  const std::optional<Box2d> box = ProjectToBox(solid, T_map_camera, camera);
  const Box2d shown = box ? ClipToImage(DistortBox(*box, camera), camera) : Box2d();
  return shown.Area() > 0.0 ? std::optional(shown) : std::nullopt;
}

std::vector<BudgetFrame> ReadFrames(const RecordingReader& recording, const PoseAtTime& T_map_camera,
                                    const PoseAtTime& true_T_map_camera, const ObjectOptions& options) {
  std::vector<BudgetFrame> frames;
  InputImages images(recording);
  for (int i = 0; i < recording.Size(); ++i) {
    const MapSnapshotPtr map = recording.Read(i);
    const std::optional<Rigid3d> pose = T_map_camera(map->timestamp);
    if (!pose || (!frames.empty() && map->frame_index <= frames.back().index)) {
      continue;
    }
    ObjectFrame frame{map->frame_index, *pose, map->camera, {}, {}, {}};
    std::vector<Box2d> regions;
    for (const SnapshotDetection& detection : map->detections) {
      frame.detections.push_back(detection.detection);
      regions.push_back(detection.detection.box);
    }
    const cv::Mat image = images.Read(*map);
    ThrowIf<InputError>(image.empty(),
                        "frame {}: its image is not there, expected the sequence that was mapped ({})",
                        map->frame_index, images.WhyNot());
    cv::Mat gray;
    cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
    frames.push_back({map->frame_index, *pose, true_T_map_camera(map->timestamp),
                      SelectBoxes(frame, options.detections, options.outliers.depth_iqr),
                      ExtractLines(gray, map->camera, regions, options.yaw)});
  }
  return frames;
}

// Returns for each object the index of its box in each frame by the true solids' projections, or -1:
// greedily, pairs with the largest IoU first.
std::vector<std::vector<int>> TrueBoxes(const std::vector<BudgetFrame>& frames,
                                        const std::vector<PosedSuperquadric>& solids, const Camera& camera) {
  constexpr double kLeast = 0.3;  // IoU
  std::vector<std::vector<int>> boxes(solids.size(), std::vector<int>(frames.size(), -1));
  for (std::size_t f = 0; f < frames.size(); ++f) {
    std::vector<std::tuple<double, std::size_t, int>> pairs;  // negative IoU, object, box
    for (std::size_t k = 0; k < solids.size(); ++k) {
      const std::optional<Box2d> shown = ShownBox(solids[k], TruePose(frames[f]), camera);
      for (int b = 0; shown && b < static_cast<int>(frames[f].boxes.size()); ++b) {
        const double iou = IoU(*shown, frames[f].boxes[static_cast<std::size_t>(b)].detection.box);
        if (iou >= kLeast) {
          pairs.emplace_back(-iou, k, b);
        }
      }
    }
    std::ranges::sort(pairs);
    std::vector<bool> taken(frames[f].boxes.size(), false);
    for (const auto& [iou, k, b] : pairs) {
      if (boxes[k][f] < 0 && !taken[static_cast<std::size_t>(b)]) {
        boxes[k][f] = b;
        taken[static_cast<std::size_t>(b)] = true;
      }
    }
  }
  return boxes;
}

// A landmark's evidence, parts of which can be replaced by the truth.
class Refit {
 public:
  Refit(const MapSnapshot& map, const std::vector<BudgetFrame>& frames, const Solid& truth,
        const std::vector<int>& true_boxes, Landmark landmark, EstimationContext context)
      : map_(map),
        frames_(frames),
        truth_(truth),
        true_boxes_(true_boxes),
        landmark_(std::move(landmark)),
        context_(std::move(context)) {}

  void Replace(TruePart part) {
    const PosedSuperquadric solid = truth_.ToSuperquadric();
    const bool all = part == TruePart::kAll;
    if (all || part == TruePart::kAssociation) {
      TakeTrueBoxesAndPoints();
    }
    if (all || part == TruePart::kPoses) {
      TakeTruePoses();
    }
    if (all || part == TruePart::kBoxes) {
      ProjectBoxes(solid);
    }
    if (part == TruePart::kEdges) {  // all of them are where boxes are whole
      JudgeEdges(solid);
    }
    if (all || part == TruePart::kYaw) {
      context_.given.yaw = YawOf(solid.T_map_object.rotation);
    }
    if (all || part == TruePart::kSupport) {
      context_.given.support =
          solid.T_map_object.translation.z() - SupportExtent(solid, -Eigen::Vector3d::UnitZ());
    }
    if (all || part == TruePart::kShape) {
      context_.given.kind = NearestKind(solid.shape.e1, solid.shape.e2);
    }
  }

  // Returns the 3D IoU with the truth; empty if there is too little evidence.
  std::optional<double> Fit() {
    constexpr std::size_t kFewestViews = 5;  // as many as EstimateLandmark() requires
    constexpr std::size_t kFewestPoints = 4;
    std::vector<BoxView> views = SpreadViews(landmark_.views, context_.options->refinement.max_views);
    if (views.size() < kFewestViews || landmark_.points.size() < kFewestPoints) {
      return std::nullopt;
    }
    if (!edges_known_) {
      MarkHiddenEdges(landmark_, context_, views);
    }
    if (const std::optional<StandingFit> fit = RefineLandmark(landmark_, views, true, context_)) {
      TakeFit(landmark_, *fit, views, context_);
    }
    return IoU(Solid::FromSuperquadric(landmark_.superquadric), truth_);
  }

 private:
  const BudgetFrame* FrameOf(std::int64_t index) const { return FrameWith(index, frames_); }

  void TakeTrueBoxesAndPoints() {
    constexpr double kGrown = 1.05;
    landmark_.views.clear();
    landmark_.lines.clear();
    for (std::size_t f = 0; f < frames_.size(); ++f) {
      if (true_boxes_[f] < 0) {
        continue;
      }
      const BudgetFrame& frame = frames_[f];
      const BoxCandidate& box = frame.boxes[static_cast<std::size_t>(true_boxes_[f])];
      const BoxView view{frame.index, frame.T_map_camera, box.detection.box, box.FreeEdges()};
      landmark_.views.push_back(view);
      landmark_.lines.emplace_back(frame.index,
                                   LinesOfBox(frame, view.box, context_.camera, context_.options->yaw));
    }
    const Rigid3d T_object_map = truth_.T_map_object.Inverse();
    SetPoints(map_, landmark_, [&](std::size_t i) {
      return truth_.RadialScale(T_object_map * map_.points[i].p_map.cast<double>()) < kGrown;
    });
  }

  void TakeTruePoses() {
    landmark_.ForEachPose([&](std::int64_t index, Rigid3d& T_map_camera) {
      if (const BudgetFrame* frame = FrameOf(index)) {
        T_map_camera = TruePose(*frame);
      }
    });
  }

  void ProjectBoxes(const PosedSuperquadric& solid) {
    constexpr double kBorder = 1.0;  // px
    edges_known_ = true;
    std::vector<BoxView> views;
    for (BoxView view : landmark_.views) {
      const BudgetFrame* frame = FrameOf(view.frame_index);
      if (const auto box = frame != nullptr ? ShownBox(solid, TruePose(*frame), context_.camera)
                                            : std::optional<Box2d>()) {
        view.box = *box;
        view.edge_free = {box->x > kBorder, box->y > kBorder,
                          box->x + box->width < context_.camera.width - kBorder,
                          box->y + box->height < context_.camera.height - kBorder};
        views.push_back(view);
      }
    }
    landmark_.views = std::move(views);
  }

  // Marks the edges that are near those of the whole solid as free, and no others.
  void JudgeEdges(const PosedSuperquadric& solid) {
    constexpr double kNear = 3.0;  // px
    constexpr double kNearShare = 0.03;
    edges_known_ = true;
    for (BoxView& view : landmark_.views) {
      const BudgetFrame* frame = FrameOf(view.frame_index);
      const auto box =
          frame != nullptr ? ProjectToBox(solid, TruePose(*frame), context_.camera) : std::optional<Box2d>();
      if (!box) {
        view.edge_free = {};
        continue;
      }
      const Box2d shown = UndistortBox(view.box, context_.camera);
      const double near_x = kNear + kNearShare * shown.width;
      const double near_y = kNear + kNearShare * shown.height;
      view.edge_free = {std::abs(shown.x - box->x) < near_x, std::abs(shown.y - box->y) < near_y,
                        std::abs(shown.x + shown.width - box->x - box->width) < near_x,
                        std::abs(shown.y + shown.height - box->y - box->height) < near_y};
    }
  }

  const MapSnapshot& map_;
  const std::vector<BudgetFrame>& frames_;
  Solid truth_;  // map frame
  const std::vector<int>& true_boxes_;
  Landmark landmark_;
  EstimationContext context_;
  bool edges_known_ = false;  // hidden edges are not looked for
};

void AddLines(const std::vector<BudgetFrame>& frames, const Camera& camera, const YawOptions& options,
              Landmark& landmark) {
  for (const BoxView& view : landmark.views) {
    if (const BudgetFrame* frame = FrameWith(view.frame_index, frames)) {
      landmark.lines.emplace_back(view.frame_index, LinesOfBox(*frame, view.box, camera, options));
    }
  }
}

// The recorded evidence of a run on its objects, with lines extracted from the images again.
struct RecordedEvidence {
  MapSnapshotPtr map;  // the last
  std::vector<BudgetFrame> frames;
  SupportSurfaces supports;
  ClassPriors classes;
  std::map<int, Landmark> landmarks;  // by id

  RecordedEvidence(const RecordingReader& recording, const PoseAtTime& poses, const PoseAtTime& true_poses,
                   const ObjectOptions& options)
      : map(recording.Last()),
        frames(ReadFrames(recording, poses, true_poses, options)),
        supports(SupportSurfaces::Find(PositionsOf(*map), options.gravity)),
        classes(ClassPriors::Named(options.class_priors)),
        landmarks(RecordedLandmarks(recording, *map, poses, supports, options)) {
    for (auto& [id, landmark] : landmarks) {
      AddLines(frames, map->camera, options.yaw, landmark);
    }
  }

  EstimationContext ContextOf(int id, const ObjectOptions& options) const {
    const std::vector<const Landmark*> all =
        ToVector(landmarks | std::views::values, [](const auto& landmark) { return &landmark; });
    return {.options = &options,
            .camera = map->camera,
            .upright = true,
            .supports = &supports,
            .surroundings = SurroundingsOf(landmarks.at(id), all, classes),
            .classes = &classes,
            .scale = ScaleWithout(id, SizedAmong(all, classes)),
            .thorough = true};
  }
};

// Returns the IoU of the refits of one object with each part of the truth in turn; empty if there is too
// little evidence.
std::optional<ObjectBudget> BudgetOf(const ObjectMatch& match, const Refit& refit) {
  const std::optional<double> own = Refit(refit).Fit();
  if (!own) {
    return std::nullopt;
  }
  ObjectBudget object{match.mapped, match.truth, match.iou, *own, {}};
  for (std::size_t part = 0; part < kTrueParts; ++part) {
    Refit replaced = refit;
    replaced.Replace(static_cast<TruePart>(part));
    object.with[part] = replaced.Fit();
  }
  return object;
}

}  // namespace

ErrorBudget ComputeErrorBudget(const fs::path& result, const fs::path& sequence, const ObjectOptions& options,
                               const EvaluationOptions& evaluation_options) {
  ErrorBudget budget{EvaluateResult(result, sequence, evaluation_options), {}};
  const Evaluation& evaluation = budget.evaluation;
  const fs::path file = result / "map.sqmap";
  ThrowIf<InputError>(!evaluation.has_objects, "{}: holds no objects_gt.json, expected the true objects",
                      sequence.string());
  const RecordingReader recording(file);
  if (const MapSnapshotPtr map = recording.Last();
      options.method != ObjectMethod::kRefined || !map->gravity_known) {
    throw InputError("{}: holds no refined objects, expected an upright map of objects.method=refined",
                     file.string());
  }
  const Sim3d S_map_world = evaluation.trajectory.S_world_map.Inverse();
  const Trajectory truth = ReadTruePoses(sequence);
  const PoseAtTime true_poses = [&](double timestamp) -> std::optional<Rigid3d> {
    const auto pose = TruePoseAt(truth, timestamp, evaluation_options.max_time_difference);
    return pose ? std::optional(S_map_world * *pose) : std::nullopt;
  };
  const RecordedEvidence evidence(recording, PosesByTime(ReadTrajectory(result / "trajectory.txt")),
                                  true_poses, options);
  const std::vector<PosedSuperquadric> true_solids =
      ToVector(evaluation.truth,
               [&](const GroundTruthObject& object) { return S_map_world * object.solid.ToSuperquadric(); });
  const std::vector<std::vector<int>> true_boxes =
      TrueBoxes(evidence.frames, true_solids, evidence.map->camera);
  for (const ObjectMatch& match : evaluation.objects.matches) {
    const auto landmark = evidence.landmarks.find(evaluation.Mapped(match.mapped).id);
    if (landmark == evidence.landmarks.end()) {
      continue;
    }
    const Refit refit(*evidence.map, evidence.frames,
                      Transform(S_map_world, evaluation.Truth(match.truth).solid),
                      true_boxes[static_cast<std::size_t>(match.truth)], landmark->second,
                      evidence.ContextOf(landmark->first, options));
    if (const std::optional<ObjectBudget> object = BudgetOf(match, refit)) {
      budget.objects.push_back(*object);
    }
  }
  ThrowIf<InputError>(budget.objects.empty(),
                      "{}: no matched object has five recorded boxes and four points, expected at least one",
                      file.string());
  return budget;
}

}  // namespace sqslam
