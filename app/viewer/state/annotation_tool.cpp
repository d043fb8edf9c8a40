#include <fmt/format.h>

#include <limits>
#include <utility>

#include "app/viewer/model/annotation_points.h"
#include "app/viewer/model/edited_document.h"
#include "app/viewer/state/editing.h"
#include "app/viewer/state/scene_view.h"

namespace sqslam::viewer {
namespace {

void Do(const EditContext& context, const std::string& what, auto change, const std::string& group = "") {
  context.messages.Try([&] {
    context.editing.document.Do(
        what, [&](EditedState& state) { change(state.annotation); }, group);
  });
}

void Replace(const EditContext& context, const std::string& what, const AnnotatedSolid& solid) {
  Do(context, what, [&](Annotation& annotation) { annotation.Replace(solid); });
}

Ray RayAt(const SceneView& view, const Eigen::Vector2d& pixel) {
  return RayOf(view.camera, pixel, view.size);
}

Sim3d FileFrame(const AnnotationTool& tool) {
  return tool.in_world && tool.S_world_map ? *tool.S_world_map : Sim3d();
}

std::string WhatOf(const AnnotatedSolid& solid) { return fmt::format("{} {}", solid.label, solid.id); }

// Returns the point where the view axis meets the ground; the focal point if it does not.
Eigen::Vector3d PlaceInView(const EditContext& context) {
  const AnnotationTool& tool = context.editing.annotation;
  const ViewCamera& camera = context.view.camera;
  Eigen::Vector3d place = camera.focal_point;
  const Eigen::Vector3d direction = camera.focal_point - camera.position;
  if (tool.ground && direction.z() < -1e-3 * direction.norm()) {
    const double t = (*tool.ground - camera.position.z()) / direction.z();
    if (t > 0.0 && t < 3.0) {
      place = camera.position + t * direction;
    }
  }
  return place;
}

// Fits a solid of a kind to points and shows the RMS error.
Solid Fit(const EditContext& context, SolidKind kind, const Points& points) {
  const AnnotationTool& tool = context.editing.annotation;
  const PrimitiveFit fit =
      FitPrimitive(points, kind, {.round = tool.round, .ground = tool.standing ? tool.ground : std::nullopt});
  context.messages.Say(
      fmt::format("fitted to {} points, rms {:.3g} {}", fit.points, fit.rms, UnitOf(*context.document.last)));
  return fit.solid;
}

// Returns the chosen points, or those in and close around the solid, without points of the ground.
Points PointsFor(const AnnotationTool& tool, const Solid& solid) {
  constexpr double kAround = 1.15;
  std::vector<int> chosen = tool.chosen;
  if (chosen.empty()) {
    chosen = SelectInBox(*tool.cloud, {solid.T_map_object, kAround * solid.half_size});
  }
  if (tool.ground && tool.standing) {
    chosen = AboveGround(*tool.cloud, chosen, *tool.ground, 0.04 * solid.half_size.mean());
  }
  return PointsAt(*tool.cloud, chosen);
}

}  // namespace

void PrepareAnnotation(const EditContext& context) {
  AnnotationTool& tool = context.editing.annotation;
  const MapSnapshotPtr& map = context.document.last;
  if (!map || tool.prepared_for == map) {
    return;
  }
  const bool first = tool.prepared_for == nullptr;
  tool.prepared_for = map;
  tool.ground = GroundHeight(*map);
  if (tool.cloud_file.empty()) {
    auto cloud = std::make_shared<Points>(PositionsOf(*map));
    if (!tool.cloud || cloud->size() != tool.cloud->size()) {
      tool.chosen.clear();
    }
    tool.cloud = std::move(cloud);
  }
  if (first && tool.file.empty()) {
    tool.file = (context.document.file.parent_path() / "objects_gt.json").string();
  }
}

const AnnotatedSolid* SelectedSolid(const EditContext& context) {
  const AnnotationTool& tool = context.editing.annotation;
  return tool.selected ? context.editing.Solids().Find(*tool.selected) : nullptr;
}

void AddSolid(const EditContext& context, SolidKind kind) {
  AnnotationTool& tool = context.editing.annotation;
  context.messages.Try([&] {
    AnnotatedSolid solid;
    solid.label = tool.label;
    if (!tool.chosen.empty()) {
      solid.solid = Fit(context, kind, PointsAt(*tool.cloud, tool.chosen));
    } else {
      const double size = 0.12 * context.view.focus.radius;
      solid.solid = UprightSolid(kind, PlaceInView(context), 0.0, Eigen::Vector3d(size, size, size));
      if (tool.ground && tool.standing) {
        SnapToGround(solid.solid, *tool.ground, GroundSnap::kMove);
      }
    }
    Do(context, "Add " + std::string(NameOf(kind)),
       [&](Annotation& annotation) { tool.selected = annotation.Add(solid); });
    tool.chosen.clear();
  });
}

void AddSolidOf(const EditContext& context, const SnapshotObject& object) {
  AnnotatedSolid solid;
  solid.label = object.label;
  solid.solid = Solid::FromSuperquadric(object.superquadric);
  Do(context, "Add " + object.label,
     [&](Annotation& annotation) { context.editing.annotation.selected = annotation.Add(solid); });
}

void RemoveSolid(const EditContext& context) {
  if (const AnnotatedSolid* solid = SelectedSolid(context)) {
    const int id = solid->id;
    Do(context, "Remove " + WhatOf(*solid), [&](Annotation& annotation) { annotation.Remove(id); });
    context.editing.annotation.selected.reset();
  }
}

void ChangeSolid(const EditContext& context, const AnnotatedSolid& solid) {
  Do(
      context, "Change " + WhatOf(solid), [&](Annotation& annotation) { annotation.Replace(solid); },
      fmt::format("solid {}", solid.id));
}

void StandOnGround(const EditContext& context) {
  const AnnotatedSolid* solid = SelectedSolid(context);
  const std::optional<double> ground = context.editing.annotation.ground;
  if (solid == nullptr || !ground) {
    return;
  }
  AnnotatedSolid moved = *solid;
  SnapToGround(moved.solid, *ground, GroundSnap::kMove);
  Replace(context, "Put " + WhatOf(moved) + " on the ground", moved);
}

void FitSolid(const EditContext& context) {
  AnnotationTool& tool = context.editing.annotation;
  const AnnotatedSolid* solid = SelectedSolid(context);
  if (solid == nullptr || !tool.cloud) {
    return;
  }
  context.messages.Try([&] {
    AnnotatedSolid fitted = *solid;
    fitted.solid = Fit(context, solid->solid.kind, PointsFor(tool, solid->solid));
    Replace(context, "Fit " + WhatOf(fitted), fitted);
  });
}

void FinishLasso(const EditContext& context, SelectMode mode) {
  AnnotationTool& tool = context.editing.annotation;
  const std::vector<Eigen::Vector2d> outline = std::exchange(tool.outline, {});
  if (!tool.cloud || outline.size() < 3) {
    return;
  }
  std::vector<int> inside = SelectInLasso(
      *tool.cloud, outline, PinholeOf(context.view.camera, context.view.size), PoseOf(context.view.camera));
  if (const std::optional<ClipPlane> cut = context.view.Cut()) {
    std::erase_if(inside,
                  [&](int index) { return !cut->Keeps((*tool.cloud)[static_cast<std::size_t>(index)]); });
  }
  tool.chosen = Combine(tool.chosen, inside, mode);
}

std::optional<SolidHandle> HandleAt(const EditContext& context, const Eigen::Vector2d& pixel, double reach) {
  const AnnotatedSolid* solid = SelectedSolid(context);
  std::optional<SolidHandle> best;
  if (solid == nullptr) {
    return best;
  }
  const Camera camera = PinholeOf(context.view.camera, context.view.size);
  const Rigid3d T_view_map = PoseOf(context.view.camera).Inverse();
  for (const SolidHandle& handle : SolidHandles()) {
    const Eigen::Vector3d p = T_view_map * HandlePosition(solid->solid, handle);
    const double distance = p.z() > 0.0 ? (camera.Project(p) - pixel).norm() : reach;
    if (distance < reach) {
      reach = distance;
      best = handle;
    }
  }
  return best;
}

std::optional<int> SolidAt(const EditContext& context, const Eigen::Vector2d& pixel) {
  const Ray ray = RayAt(context.view, pixel);
  std::optional<int> best;
  double nearest = std::numeric_limits<double>::infinity();
  for (const AnnotatedSolid& solid : context.editing.Solids().solids) {
    const std::optional<double> at = Meet(ray, AsSuperquadric(solid.solid));
    if (at && *at < nearest) {
      nearest = *at;
      best = solid.id;
    }
  }
  return best;
}

void BeginDrag(const EditContext& context, const SolidHandle& handle, const Eigen::Vector2d& pixel) {
  if (const AnnotatedSolid* solid = SelectedSolid(context)) {
    context.editing.document.EndGroup();
    context.editing.annotation.drag = AnnotationTool::Drag{handle, *solid, RayAt(context.view, pixel)};
  }
}

void DragTo(const EditContext& context, const Eigen::Vector2d& pixel) {
  const std::optional<AnnotationTool::Drag>& drag = context.editing.annotation.drag;
  if (drag) {
    AnnotatedSolid changed = drag->start;
    changed.solid = DragHandle(drag->start.solid, drag->handle, drag->from, RayAt(context.view, pixel));
    ChangeSolid(context, changed);
  }
}

void EndDrag(const EditContext& context) {
  context.editing.annotation.drag.reset();
  context.editing.document.EndGroup();
}

void OpenAnnotationFile(const EditContext& context) {
  AnnotationTool& tool = context.editing.annotation;
  context.messages.Try([&] {
    context.editing.document.OpenAnnotation(tool.file, FileFrame(tool));
    tool.selected.reset();
    context.messages.Say(fmt::format("{} solids read", context.editing.Solids().solids.size()));
  });
}

void SaveAnnotationFile(const EditContext& context) {
  AnnotationTool& tool = context.editing.annotation;
  context.messages.Try([&] {
    context.editing.document.SaveAnnotation(tool.file, FileFrame(tool));
    context.messages.Say(tool.file + " saved");
  });
}

void OpenCloudFile(const EditContext& context) {
  AnnotationTool& tool = context.editing.annotation;
  context.messages.Try([&] {
    tool.cloud = std::make_shared<Points>(
        tool.cloud_file.empty() ? (context.document.last ? PositionsOf(*context.document.last) : Points())
                                : ReadPoints(tool.cloud_file, FileFrame(tool).Inverse()));
    tool.chosen.clear();
    context.messages.Say(fmt::format("{} points", tool.cloud->size()));
  });
}

bool AlignWithWorld(const EditContext& context) {
  AnnotationTool& tool = context.editing.annotation;
  if (!tool.S_world_map) {
    context.messages.Try([&] {
      tool.S_world_map =
          AlignToGroundTruth(context.document.file.parent_path(), context.document.info.sequence_path);
    });
  }
  return tool.S_world_map.has_value();
}

}  // namespace sqslam::viewer
