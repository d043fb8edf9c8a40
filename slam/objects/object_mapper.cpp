#include "slam/objects/object_mapper.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "slam/geometry/angles.h"
#include "slam/objects/object_mapper_impl.h"
#include "slam/objects/paper_method.h"
#include "slam/util/raise_keys.h"

namespace sqslam {
namespace {

// Shifts the id of a landmark, those of its map points, and the indices of its frames.
void Renumber(int id_shift, std::int64_t point_shift, std::int64_t frame_shift, Landmark& landmark) {
  landmark.id += id_shift;
  for (BoxView& view : landmark.views) {
    view.frame_index += frame_shift;
  }
  for (auto& [frame, view] : landmark.lines) {
    frame += frame_shift;
  }
  RaiseKeys(landmark.votes, point_shift);
  for (auto& [point, p_map] : landmark.points) {
    point += point_shift;
  }
  for (PointVerdict& verdict : landmark.verdicts) {
    verdict.point += point_shift;
  }
}

}  // namespace

ObjectMapper::ObjectMapper(const ObjectOptions& options, std::uint64_t seed) : impl_(new Impl) {
  impl_->options = OptionsOfMethod(options);
  impl_->seed = seed;
  impl_->classes = ClassPriors::Named(impl_->options.class_priors);
}
ObjectMapper::~ObjectMapper() = default;
ObjectMapper::ObjectMapper(ObjectMapper&&) noexcept = default;
ObjectMapper& ObjectMapper::operator=(ObjectMapper&&) noexcept = default;

void ObjectMapper::AddObservations(std::span<const ObjectObservation> observations) {
  for (const ObjectObservation& observation : observations) {
    const int id = impl_->Surviving(observation.object_id);
    const auto& deleted = impl_->deleted;
    impl_->newest_frame = std::max(impl_->newest_frame, observation.frame_index);
    // The tracking thread may lag behind: its observations of deleted landmarks are dropped. Most are of
    // present ones, which are found sooner.
    if (impl_->landmarks.contains(id) || std::ranges::find(deleted, id) == deleted.end()) {
      Landmark& landmark = impl_->landmarks[id];
      landmark.id = id;
      landmark.Add(observation);
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
  const double before = BoxAgreement(landmark.superquadric, views, camera);
  const double agreement = BoxAgreement(superquadric, views, camera);
  if (impl_->options.method == ObjectMethod::kRefined && agreement < before - kMayLose) {
    return false;
  }
  landmark.superquadric = superquadric;
  landmark.visible = superquadric;
  landmark.box_agreement = agreement;
  impl_->Publish();
  return true;
}

void ObjectMapper::Transform(const Sim3d& S_new_old) {
  for (auto& [id, landmark] : impl_->landmarks) {
    landmark.Transform(S_new_old);
  }
  impl_->supports.Transform(S_new_old);  // other motions than those about z come with a new SetUpright()
  impl_->Publish();
}

void ObjectMapper::MoveWith(const MotionLookup& S_new_old) {
  for (auto& [id, landmark] : impl_->landmarks) {
    landmark.MoveWith(S_new_old);
  }
  impl_->Publish();
}

void ObjectMapper::Absorb(ObjectMapper&& other) {
  Impl& theirs = *other.impl_;
  other.Outdate();
  impl_->landmarks.merge(theirs.landmarks);
  impl_->merged_into.merge(theirs.merged_into);
  impl_->known.merge(theirs.known);
  impl_->merges.insert(impl_->merges.end(), theirs.merges.begin(), theirs.merges.end());
  impl_->deleted.insert(impl_->deleted.end(), theirs.deleted.begin(), theirs.deleted.end());
  impl_->newest_frame = std::max(impl_->newest_frame, theirs.newest_frame);
  impl_->Publish();
}

std::vector<SnapshotObject> ObjectMapper::Objects() const {
  std::vector<SnapshotObject> objects;
  for (const auto& [id, landmark] : impl_->landmarks) {
    const std::optional<PosedSuperquadric> solid = impl_->Represented(landmark);
    if (!solid) {
      continue;
    }
    SnapshotObject object;
    object.id = id;
    object.label = landmark.labels.Best();
    object.score = landmark.labels.BestScore();
    object.observations = landmark.observations;
    object.points = static_cast<int>(landmark.points.size());
    object.superquadric = *solid;
    object.fit = impl_->FitOf(landmark, *solid);
    object.yaw = YawOf(solid->T_map_object.rotation);
    objects.push_back(std::move(object));
  }
  return objects;
}

int ObjectMapper::LeftOut() const {
  return static_cast<int>(std::ranges::count_if(impl_->landmarks, [&](const auto& landmark) {
    return impl_->IsPublished(landmark.second) && !impl_->Represented(landmark.second);
  }));
}

void ObjectMapper::Renumber(int id_shift, std::int64_t point_shift, std::int64_t frame_shift) {
  RaiseKeys(impl_->landmarks, id_shift);
  for (auto& [id, landmark] : impl_->landmarks) {
    sqslam::Renumber(id_shift, point_shift, frame_shift, landmark);
  }
  RaiseKeys(impl_->merged_into, id_shift);
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
  RaiseKeys(impl_->known, id_shift);
  impl_->newest_frame += frame_shift;
  impl_->Publish();
}

void ObjectMapper::Save(ByteWriter& writer) const { writer(*impl_); }

void ObjectMapper::Load(ByteReader& reader) {
  reader(*impl_);
  impl_->Check(reader);
  for (const auto& [id, landmark] : impl_->landmarks) {
    if (impl_->IsPublished(landmark)) {
      impl_->known.insert(id);
    }
  }
  impl_->Publish();
}

std::shared_ptr<const ObjectMapView> ObjectMapper::View() const { return impl_->view; }

std::vector<std::vector<LineView>> ObjectMapper::Lines() const {
  return ToVector(impl_->landmarks | std::views::values,
                  [](const Landmark& landmark) { return ToVector(landmark.lines | std::views::values); });
}

std::unordered_map<std::int64_t, int> ObjectMapper::PointObjects() const {
  std::unordered_map<std::int64_t, int> owners;
  std::unordered_map<std::int64_t, double> distances;
  for (const auto& [id, landmark] : impl_->landmarks) {
    if (!impl_->Represented(landmark)) {
      continue;
    }
    const Rigid3d T_object_map = landmark.superquadric.T_map_object.Inverse();
    for (const auto& [point, p] : landmark.points) {
      // A point in the boxes of two objects belongs to the one whose surface it is nearer to.
      const double distance = std::abs(landmark.superquadric.shape.RadialDistance(T_object_map * p));
      const auto [it, is_new] = distances.emplace(point, distance);
      if (is_new || distance < it->second) {
        it->second = distance;
        owners[point] = id;
      }
    }
  }
  return owners;
}

std::unordered_map<std::int64_t, PointEvidence> ObjectMapper::Evidence() const {
  std::unordered_map<std::int64_t, PointEvidence> evidence;
  for (const auto& [point, id] : PointObjects()) {
    evidence[point].object_id = id;
  }
  std::unordered_map<std::int64_t, int> sightings;  // in the boxes of the object that rejected the point
  for (const auto& [id, landmark] : impl_->landmarks) {
    if (!impl_->Represented(landmark)) {
      continue;
    }
    for (const PointVerdict& verdict : landmark.verdicts) {
      PointEvidence& of_point = evidence[verdict.point];
      if (verdict.kept) {
        of_point.anomaly = of_point.object_id == id ? verdict.anomaly : of_point.anomaly;
      } else if (verdict.sightings > sightings[verdict.point]) {
        sightings[verdict.point] = verdict.sightings;
        of_point.rejected_by = id;
        of_point.anomaly = of_point.object_id < 0 ? verdict.anomaly : of_point.anomaly;
      }
    }
  }
  return evidence;
}

}  // namespace sqslam
