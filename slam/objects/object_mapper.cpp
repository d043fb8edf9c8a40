#include "slam/objects/object_mapper.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <ranges>
#include <set>
#include <utility>
#include <vector>

#include "slam/objects/dual_quadric.h"
#include "slam/objects/edge_noise.h"
#include "slam/objects/landmark.h"
#include "slam/objects/landmark_estimation.h"
#include "slam/objects/landmark_outliers.h"
#include "slam/objects/late_association.h"
#include "slam/objects/merging.h"
#include "slam/objects/paper_method.h"
#include "slam/objects/point_evidence.h"
#include "slam/objects/shown_objects.h"
#include "slam/objects/single_view_quadric.h"
#include "slam/objects/surroundings.h"
#include "slam/objects/visibility.h"
#include "slam/snapshot/byte_archive.h"
#include "slam/util/limits.h"
#include "slam/util/raise_keys.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

void UpdatePoses(const PoseLookup& poses, Landmark& landmark) {
  if (poses) {
    landmark.ForEachPose([&](std::int64_t frame, Rigid3d& T_map_camera) {
      T_map_camera = poses(frame).value_or(T_map_camera);
    });
  }
}

}  // namespace

struct ObjectMapper::Impl {
  ObjectOptions options;
  ClassTable classes;
  std::uint64_t seed = 0;
  std::map<int, Landmark> landmarks;  // by id
  std::map<int, int> merged_into;     // old id -> surviving id (may have been merged on)
  std::vector<std::pair<int, int>> merges;
  std::vector<int> deleted;
  std::vector<Landmark> left;  // boxes that began no landmark, and forgotten landmarks; of no id
  ObjectAccount settled;       // boxes that were used, landmarks that are gone
  bool upright = false;
  SupportSurfaces supports;
  std::optional<Camera> last_camera;  // of the last update
  std::int64_t newest_frame = 0;
  std::int64_t version = 0;
  std::shared_ptr<const ObjectMapView> view = std::make_shared<ObjectMapView>();

  static void VisitState(auto& self, auto&& visit) {
    visit(self.landmarks, self.merged_into, self.merges, self.deleted, self.upright, self.newest_frame);
  }

  // Throws InputError if the state read is invalid: cycles of merges, objects of impossible size.
  void Check(const ByteReader& reader) const {
    for (const auto& [from, to] : merged_into) {
      if (to >= from) {  // the older one stays
        reader.Refuse("has objects that were merged in a circle");
      }
    }
    for (const auto& [id, landmark] : landmarks) {
      const auto& [shape, T_map_object] = landmark.superquadric;
      const bool sound = shape.half_size.allFinite() && shape.half_size.minCoeff() > 0.0 &&
                         shape.half_size.maxCoeff() <= kMaxMapUnits && shape.e1 > 0.0 && shape.e1 < 2.0 &&
                         shape.e2 > 0.0 && shape.e2 < 2.0 && T_map_object.translation.norm() <= kMaxMapUnits;
      if (id < 0 || id != landmark.id || landmark.views.empty() || !sound) {
        reader.Refuse(fmt::format("has an impossible object {}", id));
      }
    }
  }

  int Surviving(int id) const {
    for (auto it = merged_into.find(id); it != merged_into.end(); it = merged_into.find(id)) {
      id = it->second;
    }
    return id;
  }

  void Update(const PointLookup& points, const Camera& camera, const PoseLookup& poses, bool all) {
    last_camera = camera;
    EstimationContext context{.options = &options,
                              .points = &points,
                              .camera = camera,
                              .upright = upright,
                              .supports = &supports,
                              .edge_information = all ? MeasuredInformation(camera) : 1.0,
                              .surroundings = {},
                              .classes = &classes,
                              .scale = {},
                              .thorough = all,
                              .seed = seed};
    Estimate(all ? Ids() : MostOutdated(landmarks, options.max_estimates), poses, context);
    std::vector<int> merged = MergeAllPairs(all);
    if (!all && options.max_estimates > 0) {
      std::erase_if(merged, [&](int id) { return landmarks.at(id).estimated; });
      merged.resize(std::min(merged.size(), static_cast<std::size_t>(options.max_estimates)));
    }
    Estimate(merged, poses, context);
    if (all && options.refinement.enabled) {
      std::vector<int> grouped;
      merged = AssociateLeft(poses, grouped);
      Estimate(merged, poses, context);
      RejectWithoutPoints(grouped);
    }
    while (all && !merged.empty()) {  // re-estimated ones may be duplicates of others
      merged = MergeAllPairs(all);
      Estimate(merged, poses, context);
    }
    DeleteForgotten();
    for (auto& [id, landmark] : landmarks) {
      ForgetGonePoints(landmark, points);
    }
    Publish();
  }

  void Estimate(const std::vector<int>& ids, const PoseLookup& poses, EstimationContext& context) {
    for (const int id : LargestFirst(landmarks, ids, classes, ScaleOfMap(Shown(), classes))) {
      Landmark& landmark = landmarks.at(id);
      UpdatePoses(poses, landmark);
      context.surroundings = SurroundingsOf(landmark, Shown(), classes);
      context.scale = ScaleOfMap(Shown(), classes, &landmark);
      EstimateLandmark(landmark, context);
      if (options.representation == Representation::kQuadric) {
        const std::vector<BoxView> views = SpreadViews(landmark.views, options.refinement.max_views);
        landmark.quadric = options.quadric_init == QuadricInit::kSingleView
                               ? EstimateQuadricOnSupport(landmark, views, context)
                               : EstimateDualQuadric(views, context.camera, options);
      }
    }
  }

  // Measures the information of box edges by the present estimates.
  double MeasuredInformation(const Camera& camera) const {
    std::vector<FittedViews> fitted;
    const std::vector<const Landmark*> shown = Shown();
    for (const Landmark* landmark : shown) {
      if (landmark->refined) {
        fitted.push_back(
            {landmark->visible, landmark->parts, SpreadViews(landmark->views, options.refinement.max_views)});
        const Surroundings near = SurroundingsOf(*landmark, shown, classes);
        JudgeHiddenEdges(landmark->visible, near.beneath, near.occluders, camera, options.detections,
                         fitted.back().views);
      }
    }
    return EdgeInformation(fitted, camera, options.refinement);
  }

  void ForEach(auto&& change) {
    for (auto& [id, landmark] : landmarks) {
      change(landmark);
    }
    std::ranges::for_each(left, change);
  }

  std::vector<int> Ids() const { return ToVector(landmarks | std::views::keys); }

  std::vector<const Landmark*> Where(const auto& holds) const {
    std::vector<const Landmark*> found;
    for (const auto& [id, landmark] : landmarks) {
      if (holds(landmark)) {
        found.push_back(&landmark);
      }
    }
    return found;
  }

  std::vector<const Landmark*> Shown() const {
    return Where([&](const Landmark& landmark) { return IsShown(landmark, options); });
  }

  std::vector<const Landmark*> RepresentedLandmarks() const {
    return Where([&](const Landmark& landmark) { return Represented(landmark, options).has_value(); });
  }

  // Returns the survivors, which must be re-estimated.
  std::vector<int> MergeAllPairs(bool all_refined) {
    std::set<int> survivors;
    while (const std::optional<std::pair<int, int>> pair = MergeOnePair(all_refined)) {
      survivors.erase(pair->first);
      survivors.insert(pair->second);
    }
    return {survivors.begin(), survivors.end()};
  }

  // Returns the ids of the removed landmark and of the one that absorbed it.
  std::optional<std::pair<int, int>> MergeOnePair(bool all_refined) {
    for (auto a = landmarks.begin(); a != landmarks.end(); ++a) {
      for (auto b = std::next(a); b != landmarks.end(); ++b) {
        if (AreDuplicates(a->second, b->second, options, *last_camera) ||
            (all_refined && options.refinement.enabled &&
             OccupySamePlace(a->second, b->second, *last_camera))) {
          Merge(a->first, b->first);
          return merges.back();
        }
      }
    }
    return std::nullopt;
  }

  // Merges two landmarks; the older one, `a`, keeps its id.
  void Merge(int a, int b) {
    Landmark& gone = landmarks.at(b);
    ++settled[gone.labels.Best()].merged;
    merges.emplace_back(b, a);
    merged_into[b] = a;
    landmarks.at(a).Absorb(std::move(gone));
    landmarks.erase(b);
  }

  // Counts the boxes of the landmark as used, or (-1) no longer.
  void CountUsed(const Landmark& landmark, int sign) {
    for (const auto& [label, count] : landmark.labels.Counts()) {
      settled[label].used += sign * count;
    }
  }

  // Makes the fragment part of another landmark.
  void Join(int id, Landmark& fragment) {
    const int survivor = Surviving(id);
    if (fragment.id >= 0) {
      Merge(std::min(survivor, fragment.id), std::max(survivor, fragment.id));
    } else {
      CountUsed(fragment, 1);
      landmarks.at(survivor).Absorb(std::move(fragment));
      fragment.observations = 0;
    }
  }

  int NextId() const {
    const int newest = std::max(landmarks.empty() ? 0 : landmarks.rbegin()->first,
                                merged_into.empty() ? 0 : merged_into.rbegin()->first);
    return std::max(view->IdBound(), newest + 1);
  }

  // Gives a fragment of no id a new one. Returns the id.
  int Begin(Landmark& fragment) {
    if (fragment.id < 0) {
      const int id = NextId();
      fragment.id = id;
      CountUsed(fragment, 1);
      landmarks.emplace(id, std::move(fragment));
      fragment.observations = 0;
      return id;
    }
    return fragment.id;
  }

  // Returns what shows no object: landmarks of too few boxes, and what is left.
  std::vector<Landmark*> Fragments() {
    std::vector<Landmark*> fragments;
    for (auto& [id, landmark] : landmarks) {
      if (!IsShown(landmark, options) && !landmark.moving) {
        fragments.push_back(&landmark);
      }
    }
    for (Landmark& landmark : left) {
      fragments.push_back(&landmark);
    }
    return fragments;
  }

  // Groups of left boxes may be a detector's errors that move with the image: what is there has map points.
  void RejectWithoutPoints(const std::vector<int>& grouped) {
    for (const int id : grouped) {
      Landmark& landmark = landmarks.at(Surviving(id));
      landmark.estimated =
          landmark.estimated && static_cast<int>(landmark.points.size()) >= options.min_points;
    }
  }

  // Associates what shows no object with the mapped objects, and the rest with each other (`grouped`: the
  // landmarks of such groups). Returns the landmarks that must be re-estimated.
  std::vector<int> AssociateLeft(const PoseLookup& poses, std::vector<int>& grouped) {
    for (Landmark& landmark : left) {
      UpdatePoses(poses, landmark);
    }
    std::vector<const Landmark*> mapped = Shown();
    std::erase_if(mapped, [&](const Landmark* landmark) {  // boxes that no fit would use
      return static_cast<int>(landmark->views.size()) >= options.refinement.max_views;
    });
    const std::vector<Landmark*> fragments = Fragments();
    const auto [shown, groups] =
        AssociateFragments({fragments.begin(), fragments.end()}, mapped, *last_camera);
    std::vector<std::pair<int, Landmark*>> joins;  // the id of the landmark, and what becomes part of it
    for (const auto& [fragment, object] : shown) {
      joins.emplace_back(mapped[object]->id, fragments[fragment]);
    }
    for (const std::vector<std::size_t>& group : groups) {
      const int id = Begin(*fragments[group.front()]);
      grouped.push_back(id);
      for (const std::size_t i : group | std::views::drop(1)) {
        joins.emplace_back(id, fragments[i]);
      }
    }
    for (const auto& [id, fragment] : joins) {
      Join(id, *fragment);
    }
    std::set<int> changed;
    for (const auto& [id, fragment] : joins) {
      changed.insert(Surviving(id));
    }
    CountLeft(settled);
    left.clear();
    return {changed.begin(), changed.end()};
  }

  // Counts the landmarks, not the single boxes, among what is left.
  void CountLeft(ObjectAccount& account) const {
    for (const Landmark& fragment : left) {
      if (fragment.observations > 1) {
        ++account[fragment.labels.Best()][WhyLeftOut(fragment, options).value_or(LeftOut::kFewViews)];
      }
    }
  }

  // Keeps what shows no object for the association at the end.
  void Leave(Landmark&& fragment) {
    constexpr std::size_t kMaxLeft = 5000;
    fragment.id = -1;
    if (left.size() < kMaxLeft) {
      left.push_back(std::move(fragment));
    }
  }

  void DeleteForgotten() {
    for (auto it = landmarks.begin(); it != landmarks.end();) {
      const Landmark& landmark = it->second;
      const std::int64_t age = newest_frame - landmark.views.back().frame_index;
      if (age > options.forget_after && !IsShown(landmark, options) && !landmark.known) {
        deleted.push_back(it->first);
        CountUsed(it->second, -1);
        Leave(std::move(it->second));
        it = landmarks.erase(it);
      } else {
        ++it;
      }
    }
  }

  void Publish() {
    auto next = std::make_shared<ObjectMapView>();
    next->version = ++version;
    next->upright = upright;
    for (const auto& [id, landmark] : landmarks) {
      next->landmarks.push_back({.id = id,
                                 .label = landmark.labels.Best(),
                                 .observations = landmark.observations,
                                 .points = landmark.points,
                                 .estimated = landmark.estimated,
                                 .shown = IsShown(landmark, options),
                                 .on_floor = classes.Of(landmark.labels.Best()).on_floor,
                                 .superquadric = landmark.superquadric,
                                 .visible = landmark.visible,
                                 .parts = landmark.parts,
                                 .centroids = landmark.centroids});
    }
    next->merges = merges;
    next->deleted = deleted;
    view = std::move(next);
  }
};

ObjectMapper::ObjectMapper(const ObjectOptions& options, std::uint64_t seed) : impl_(new Impl) {
  impl_->options = OptionsOfMethod(options);
  impl_->seed = seed;
  impl_->classes = ClassTable::Named(impl_->options.class_priors);
}
ObjectMapper::~ObjectMapper() = default;
ObjectMapper::ObjectMapper(ObjectMapper&&) noexcept = default;
ObjectMapper& ObjectMapper::operator=(ObjectMapper&&) noexcept = default;

void ObjectMapper::AddObservations(std::span<const ObjectObservation> observations) {
  for (const ObjectObservation& observation : observations) {
    if (observation.object_id < 0) {
      Landmark box;
      box.Add(observation);
      impl_->Leave(std::move(box));
      continue;
    }
    const int id = impl_->Surviving(observation.object_id);
    const auto& deleted = impl_->deleted;
    impl_->newest_frame = std::max(impl_->newest_frame, observation.frame_index);
    // The tracking thread may lag behind: its observations of deleted landmarks are dropped. Most are of
    // present ones, which are found sooner.
    if (impl_->landmarks.contains(id) || std::ranges::find(deleted, id) == deleted.end()) {
      Landmark& landmark = impl_->landmarks[id];
      landmark.id = id;
      landmark.Add(observation);
      ++impl_->settled[observation.detection.label].used;
    }
  }
}

void ObjectMapper::SetUpright(bool upright, SupportSurfaces supports) {
  if (upright != impl_->upright) {
    Outdate();
  }
  impl_->upright = upright;
  impl_->supports = std::move(supports);
}

void ObjectMapper::Update(const PointLookup& points, const Camera& camera, const PoseLookup& poses) {
  impl_->Update(points, camera, poses, false);
}

void ObjectMapper::Outdate() {
  for (auto& [id, landmark] : impl_->landmarks) {
    landmark.estimated_at = 0;
    landmark.thorough_at = 0;
  }
}

void ObjectMapper::UpdateAll(const PointLookup& points, const Camera& camera, const PoseLookup& poses) {
  impl_->Update(points, camera, poses, true);
}

bool ObjectMapper::Correct(int id, const PosedSuperquadric& superquadric, const Camera& camera) {
  constexpr double kMayLose = 0.01;  // of the mean IoU with the boxes: the effect of noise in the points
  const auto it = impl_->landmarks.find(id);
  if (it == impl_->landmarks.end() || !it->second.estimated) {
    return false;
  }
  Landmark& landmark = it->second;
  // A part completed below what the boxes show cannot be judged by them.
  if (landmark.visible.shape.half_size != landmark.superquadric.shape.half_size) {
    return false;
  }
  const std::vector<BoxView> views = SpreadViews(landmark.views, impl_->options.refinement.max_views);
  const double before = BoxAgreement(landmark.superquadric, landmark.parts, views, camera);
  const double agreement = BoxAgreement(superquadric, landmark.parts, views, camera);
  if (impl_->options.refinement.enabled && agreement < before - kMayLose) {
    return false;
  }
  landmark.superquadric = superquadric;
  landmark.visible = superquadric;
  landmark.box_agreement = agreement;
  impl_->Publish();
  return true;
}

void ObjectMapper::Transform(const Sim3d& S_new_old) {
  impl_->ForEach([&](Landmark& landmark) { landmark.Transform(S_new_old); });
  impl_->supports.Transform(S_new_old);  // other motions than those about z come with a new SetUpright()
  impl_->Publish();
}

void ObjectMapper::MoveWith(const MotionLookup& S_new_old) {
  impl_->ForEach([&](Landmark& landmark) { landmark.MoveWith(S_new_old); });
  impl_->Publish();
}

void ObjectMapper::Absorb(ObjectMapper&& other) {
  Impl& theirs = *other.impl_;
  other.Outdate();
  impl_->landmarks.merge(theirs.landmarks);
  std::ranges::move(theirs.left, std::back_inserter(impl_->left));
  impl_->merged_into.merge(theirs.merged_into);
  Add(theirs.settled, impl_->settled);
  impl_->merges.insert(impl_->merges.end(), theirs.merges.begin(), theirs.merges.end());
  impl_->deleted.insert(impl_->deleted.end(), theirs.deleted.begin(), theirs.deleted.end());
  impl_->newest_frame = std::max(impl_->newest_frame, theirs.newest_frame);
  impl_->Publish();
}

std::vector<SnapshotObject> ObjectMapper::Objects() const {
  std::vector<SnapshotObject> objects;
  for (const auto& [id, landmark] : impl_->landmarks) {
    if (auto object = ShownObject(landmark, impl_->last_camera, impl_->options)) {
      objects.push_back(std::move(*object));
    }
  }
  return objects;
}

ObjectAccount ObjectMapper::Account() const {
  ObjectAccount account = impl_->settled;
  impl_->CountLeft(account);
  for (const auto& [id, landmark] : impl_->landmarks) {
    ClassAccount& of_class = account[landmark.labels.Best()];
    const std::optional<LeftOut> reason = WhyLeftOut(landmark, impl_->options);
    ++(reason ? of_class[*reason] : of_class.shown);
  }
  return account;
}

void ObjectMapper::Renumber(int id_shift, std::int64_t point_shift, std::int64_t frame_shift) {
  ShiftKeys(impl_->landmarks, id_shift);
  impl_->ForEach([&](Landmark& landmark) { landmark.Renumber(id_shift, point_shift, frame_shift); });
  ShiftKeys(impl_->merged_into, id_shift);
  for (auto& [from, to] : impl_->merged_into) {
    to += id_shift;
  }
  for (auto& [from, to] : impl_->merges) {
    from += id_shift;
    to += id_shift;
  }
  for (int& id : impl_->deleted) {
    id += id_shift;
  }
  impl_->newest_frame += frame_shift;
  impl_->Publish();
}

void ObjectMapper::Save(ByteWriter& writer) const { writer(*impl_); }

void ObjectMapper::Load(ByteReader& reader) {
  reader(*impl_);
  impl_->Check(reader);
  for (auto& [id, landmark] : impl_->landmarks) {
    const std::optional<LeftOut> reason = WhyLeftOut(landmark, impl_->options);
    landmark.known = !reason || reason == LeftOut::kNoQuadric;
  }
  impl_->Publish();
}

std::shared_ptr<const ObjectMapView> ObjectMapper::View() const { return impl_->view; }

std::vector<std::vector<LineView>> ObjectMapper::Lines() const {
  return ToVector(impl_->landmarks | std::views::values,
                  [](const Landmark& landmark) { return ToVector(landmark.lines | std::views::values); });
}

std::unordered_map<std::int64_t, int> ObjectMapper::PointObjects() const {
  return OwnersOfPoints(impl_->RepresentedLandmarks());
}

std::unordered_map<std::int64_t, PointEvidence> ObjectMapper::Evidence() const {
  return EvidenceOfPoints(impl_->RepresentedLandmarks());
}

}  // namespace sqslam
