#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <ranges>
#include <set>
#include <utility>
#include <vector>

#include "slam/geometry/nearest_solid.h"
#include "slam/objects/dual_quadric.h"
#include "slam/objects/landmark.h"
#include "slam/objects/landmark_estimation.h"
#include "slam/objects/landmark_outliers.h"
#include "slam/objects/merging.h"
#include "slam/objects/object_mapper.h"
#include "slam/objects/single_view_quadric.h"
#include "slam/snapshot/byte_archive.h"
#include "slam/util/limits.h"
#include "slam/util/to_vector.h"

// The state of an ObjectMapper and its steps; only object_mapper.cpp includes it.
namespace sqslam {

struct ObjectMapper::Impl {
  ObjectOptions options;
  ClassPriors classes;
  std::uint64_t seed = 0;
  std::map<int, Landmark> landmarks;  // by id
  std::map<int, int> merged_into;     // old id -> surviving id (may have been merged on)
  std::vector<std::pair<int, int>> merges;
  std::vector<int> deleted;
  std::set<int> known;  // shown by an earlier run: they keep their ids, to which users may refer
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
    for (const int id :
         LargestFirst(landmarks, ids, classes, ScaleWithout({}, SizedAmong(Shown(), classes)))) {
      Landmark& landmark = landmarks.at(id);
      if (poses) {
        landmark.ForEachPose([&](std::int64_t frame, Rigid3d& T_map_camera) {
          T_map_camera = poses(frame).value_or(T_map_camera);
        });
      }
      context.surroundings = SurroundingsOf(landmark, Shown(), classes);
      context.scale = ScaleWithout(id, SizedAmong(Shown(), classes));
      EstimateLandmark(landmark, context);
      if (options.representation == Representation::kQuadric) {
        const std::vector<BoxView> views = SpreadViews(landmark.views, options.refinement.max_views);
        landmark.quadric = options.quadric_init == QuadricInit::kSingleView
                               ? EstimateQuadricOnSupport(landmark, views, context)
                               : EstimateDualQuadric(views, context.camera, options);
      }
    }
  }

  std::vector<int> Ids() const { return ToVector(landmarks | std::views::keys); }

  std::vector<const Landmark*> Shown() const {
    std::vector<const Landmark*> shown;
    for (const auto& [id, landmark] : landmarks) {
      if (IsShown(landmark)) {
        shown.push_back(&landmark);
      }
    }
    return shown;
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
        const bool refined = options.method == ObjectMethod::kRefined;
        if ((AreSameObject(a->second, b->second, options, *last_camera) &&
             !(refined && IsRatherOneWithAThird(a->second, b->second, landmarks, *last_camera))) ||
            (all_refined && refined && ShareTheirPlace(a->second, b->second, *last_camera))) {
          merges.emplace_back(b->first, a->first);
          merged_into[b->first] = a->first;
          a->second.Absorb(std::move(b->second));
          if (known.erase(b->first) > 0) {
            known.insert(a->first);
          }
          landmarks.erase(b);
          return merges.back();
        }
      }
    }
    return std::nullopt;
  }

  void DeleteForgotten() {
    for (auto it = landmarks.begin(); it != landmarks.end();) {
      const Landmark& landmark = it->second;
      const std::int64_t age = newest_frame - landmark.views.back().frame_index;
      if (age > options.forget_after && !IsShown(landmark) && !known.contains(it->first)) {
        deleted.push_back(it->first);
        it = landmarks.erase(it);
      } else {
        ++it;
      }
    }
  }

  bool IsShown(const Landmark& landmark) const {
    if (known.contains(landmark.id)) {
      return landmark.estimated;
    }
    return landmark.estimated && landmark.observations >= options.min_observations &&
           landmark.box_agreement >= (static_cast<int>(landmark.points.size()) >= options.min_points
                                          ? options.min_box_agreement
                                          : options.pointless_box_agreement);
  }

  // True if the object appears in the map. The others are kept, as more boxes may still make sense of them.
  bool IsPublished(const Landmark& landmark) const {
    return IsShown(landmark) &&
           (known.contains(landmark.id) || landmark.reliability >= options.min_reliability);
  }

  // Returns the landmark in the chosen representation; empty if it is not published or cannot be represented.
  std::optional<PosedSuperquadric> Represented(const Landmark& landmark) const {
    if (!IsPublished(landmark)) {
      return std::nullopt;
    }
    if (options.representation == Representation::kQuadric) {
      return landmark.quadric;
    }
    PosedSuperquadric solid = landmark.superquadric;
    if (options.representation != Representation::kSuperquadric) {
      const bool round = options.representation == Representation::kEllipsoid;
      const SolidKind kind = round ? SolidKind::kEllipsoid : SolidKind::kCuboid;
      if (options.method != ObjectMethod::kPaper) {
        return NearestOfKind(kind, solid);
      }
      SetExponents(kind, solid.shape.e1, solid.shape.e2);  // "both of which have the same pose and size"
    }
    return solid;
  }

  // The covariance is zero for representations other than the refined superquadric.
  ObjectFit FitOf(const Landmark& landmark, const PosedSuperquadric& solid) const {
    ObjectFit fit{landmark.box_agreement, PointRms(landmark, solid), landmark.reliability,
                  landmark.covariance};
    if (options.representation != Representation::kSuperquadric && last_camera) {
      const std::vector<BoxView> views = SpreadViews(landmark.views, options.refinement.max_views);
      fit.box_agreement = BoxAgreement(solid, views, *last_camera);
      fit.covariance.setZero();
    }
    return fit;
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
                                 .shown = IsShown(landmark),
                                 .on_floor = classes.Of(landmark.labels.Best()).on_floor,
                                 .superquadric = landmark.superquadric,
                                 .visible = landmark.visible,
                                 .centroids = landmark.centroids});
    }
    next->merges = merges;
    next->deleted = deleted;
    view = std::move(next);
  }
};

}  // namespace sqslam
