#include "app/viewer/state/annotation_tool.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "app/viewer/model/annotation_file.h"
#include "app/viewer/model/primitive_fit.h"
#include "app/viewer/state/camera_control.h"
#include "app/viewer/state/picking.h"
#include "slam/util/error.h"

namespace sqslam::viewer {
namespace {

constexpr double kReach = 9.0;  // pixels from a handle at scale 1

template <typename Action>
void Try(ViewerState& state, Action action) {
  try {
    action();
  } catch (const InputError& error) {
    state.Complain(error.what());
  } catch (const UsageError& error) {
    state.Complain(error.what());
  }
}

template <typename Change>
void Do(ViewerState& state, const std::string& what, Change change, const std::string& group = "") {
  Try(state, [&] {
    state.editing.document.Do(
        what, [&](DocumentState& document) { change(document.annotation); }, group);
  });
}

ViewRay RayAt(const ViewerState& state, const Eigen::Vector2d& pixel) {
  const Ray ray = RayOf(state.view.camera, pixel, state.scene_size);
  return {ray.origin, ray.direction};
}

std::optional<Eigen::Vector2d> PixelOf(const ViewerState& state, const Eigen::Vector3d& p_map) {
  const Eigen::Vector3d p = PoseOf(state.view.camera).Inverse() * p_map;
  if (p.z() <= 0.0) {
    return std::nullopt;
  }
  return PinholeOf(state.view.camera, state.scene_size).Project(p);
}

Sim3d FileFrame(const AnnotationTool& tool) {
  return tool.in_world && tool.S_world_map ? *tool.S_world_map : Sim3d();
}

std::string WhatOf(const AnnotatedSolid& solid) { return fmt::format("{} {}", solid.label, solid.id); }

// Where the middle of the view meets the ground; the focal point where it does not.
Eigen::Vector3d PlaceInView(const ViewerState& state) {
  const AnnotationTool& tool = state.editing.annotation;
  const ViewCamera& camera = state.view.camera;
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

// Chosen points, or those in the solid and a tenth around it. Without those of the ground that it stands on.
std::vector<Eigen::Vector3d> PointsFor(const AnnotationTool& tool, const Solid& solid) {
  constexpr double kAround = 1.15;
  std::vector<int> chosen = tool.chosen;
  if (chosen.empty()) {
    chosen = SelectInBox(tool.cloud->points, {solid.T_map_object, kAround * solid.half_size});
  }
  if (tool.ground && tool.standing) {
    chosen = AboveGround(tool.cloud->points, chosen, *tool.ground, 0.04 * solid.half_size.mean());
  }
  return PointsAt(tool.cloud->points, chosen);
}

}  // namespace

void PrepareAnnotation(ViewerState& state) {
  AnnotationTool& tool = state.editing.annotation;
  const MapSnapshotPtr& map = state.document.last;
  if (!map || tool.prepared_for == map) {
    return;
  }
  const bool first = tool.prepared_for == nullptr;
  tool.prepared_for = map;
  tool.ground = GroundHeight(*map);
  if (tool.cloud_file.empty()) {
    auto cloud = std::make_shared<AnnotationCloud>(CloudOf(*map));
    if (!tool.cloud || cloud->points.size() != tool.cloud->points.size()) {
      tool.chosen.clear();
    }
    tool.cloud = std::move(cloud);
  }
  if (first && tool.file.empty()) {
    tool.file = (state.document.file.parent_path() / "objects_gt.json").string();
  }
}

const AnnotatedSolid* SelectedSolid(const ViewerState& state) {
  const AnnotationTool& tool = state.editing.annotation;
  return tool.selected ? state.editing.document.Current().annotation.Find(*tool.selected) : nullptr;
}

void AddSolid(ViewerState& state, SolidKind kind) {
  AnnotationTool& tool = state.editing.annotation;
  Try(state, [&] {
    AnnotatedSolid solid;
    solid.label = tool.label;
    if (!tool.chosen.empty()) {
      const PrimitiveFitOptions options{.round = tool.round,
                                        .ground = tool.standing ? tool.ground : std::nullopt};
      const PrimitiveFit fit = FitPrimitive(PointsAt(tool.cloud->points, tool.chosen), kind, options);
      solid.solid = fit.solid;
      state.Say(fmt::format("fitted to {} points, rms {:.3g} map units", fit.points, fit.rms));
    } else {
      const double size = 0.12 * state.focus.radius;
      solid.solid = UprightSolid(kind, PlaceInView(state), 0.0, Eigen::Vector3d(size, size, size));
      if (tool.ground && tool.standing) {
        SnapToGround(solid.solid, *tool.ground, GroundSnap::kMove);
      }
    }
    Do(state, "Add " + std::string(KindName(kind)),
       [&](Annotation& annotation) { tool.selected = annotation.Add(solid); });
    tool.chosen.clear();
  });
}

void AddSolidOf(ViewerState& state, const SnapshotObject& object) {
  AnnotatedSolid solid;
  solid.label = object.label;
  solid.solid = Solid::FromSuperquadric(object.superquadric);
  Do(state, "Add " + object.label,
     [&](Annotation& annotation) { state.editing.annotation.selected = annotation.Add(solid); });
}

void RemoveSolid(ViewerState& state) {
  if (const AnnotatedSolid* solid = SelectedSolid(state)) {
    const int id = solid->id;
    Do(state, "Remove " + WhatOf(*solid), [&](Annotation& annotation) { annotation.Remove(id); });
    state.editing.annotation.selected.reset();
  }
}

void ChangeSolid(ViewerState& state, const AnnotatedSolid& solid) {
  Do(
      state, "Change " + WhatOf(solid), [&](Annotation& annotation) { annotation.Replace(solid); },
      fmt::format("solid {}", solid.id));
}

void StandOnGround(ViewerState& state) {
  const AnnotatedSolid* solid = SelectedSolid(state);
  const std::optional<double> ground = state.editing.annotation.ground;
  if (solid == nullptr || !ground) {
    return;
  }
  AnnotatedSolid moved = *solid;
  SnapToGround(moved.solid, *ground, GroundSnap::kMove);
  Do(state, "Put " + WhatOf(moved) + " on the ground",
     [&](Annotation& annotation) { annotation.Replace(moved); });
}

void FitSolid(ViewerState& state) {
  AnnotationTool& tool = state.editing.annotation;
  const AnnotatedSolid* solid = SelectedSolid(state);
  if (solid == nullptr || !tool.cloud) {
    return;
  }
  Try(state, [&] {
    AnnotatedSolid fitted = *solid;
    const PrimitiveFitOptions options{.round = tool.round,
                                      .ground = tool.standing ? tool.ground : std::nullopt};
    const PrimitiveFit fit = FitPrimitive(PointsFor(tool, solid->solid), solid->solid.kind, options);
    fitted.solid = fit.solid;
    state.Say(fmt::format("fitted to {} points, rms {:.3g} map units", fit.points, fit.rms));
    Do(state, "Fit " + WhatOf(fitted), [&](Annotation& annotation) { annotation.Replace(fitted); });
  });
}

void FinishLasso(ViewerState& state, SelectMode mode) {
  AnnotationTool& tool = state.editing.annotation;
  const std::vector<Eigen::Vector2d> outline = std::exchange(tool.outline, {});
  if (!tool.cloud || outline.size() < 3) {
    return;
  }
  std::vector<int> inside = SelectInLasso(
      tool.cloud->points, outline, PinholeOf(state.view.camera, state.scene_size), PoseOf(state.view.camera));
  if (const std::optional<ClipPlane> cut = CutOf(state)) {
    std::erase_if(
        inside, [&](int index) { return !cut->Keeps(tool.cloud->points[static_cast<std::size_t>(index)]); });
  }
  tool.chosen = Combine(tool.chosen, inside, mode);
}

std::optional<SolidHandle> HandleAt(const ViewerState& state, const Eigen::Vector2d& pixel) {
  const AnnotatedSolid* solid = SelectedSolid(state);
  std::optional<SolidHandle> best;
  double nearest = kReach * state.ui_scale;
  if (solid == nullptr) {
    return best;
  }
  for (const SolidHandle& handle : SolidHandles()) {
    const auto seen = PixelOf(state, HandlePosition(solid->solid, handle));
    if (seen && (*seen - pixel).norm() < nearest) {
      nearest = (*seen - pixel).norm();
      best = handle;
    }
  }
  return best;
}

std::optional<int> SolidAt(const ViewerState& state, const Eigen::Vector2d& pixel) {
  const Ray ray = RayOf(state.view.camera, pixel, state.scene_size);
  std::optional<int> best;
  double nearest = std::numeric_limits<double>::infinity();
  for (const AnnotatedSolid& solid : state.editing.document.Current().annotation.solids) {
    const std::optional<double> at = Meet(ray, AsSuperquadric(solid.solid));
    if (at && *at < nearest) {
      nearest = *at;
      best = solid.id;
    }
  }
  return best;
}

void BeginDrag(ViewerState& state, const SolidHandle& handle, const Eigen::Vector2d& pixel) {
  if (const AnnotatedSolid* solid = SelectedSolid(state)) {
    state.editing.document.EndGroup();
    state.editing.annotation.drag = AnnotationTool::Drag{handle, *solid, RayAt(state, pixel)};
  }
}

void DragTo(ViewerState& state, const Eigen::Vector2d& pixel) {
  const std::optional<AnnotationTool::Drag>& drag = state.editing.annotation.drag;
  if (drag) {
    AnnotatedSolid changed = drag->start;
    changed.solid = DragHandle(drag->start.solid, drag->handle, drag->from, RayAt(state, pixel));
    ChangeSolid(state, changed);
  }
}

void EndDrag(ViewerState& state) {
  state.editing.annotation.drag.reset();
  state.editing.document.EndGroup();
}

void OpenAnnotationFile(ViewerState& state) {
  AnnotationTool& tool = state.editing.annotation;
  Try(state, [&] {
    state.editing.document.OpenAnnotation(tool.file, FileFrame(tool));
    tool.selected.reset();
    state.Say(fmt::format("{} solids read", state.editing.document.Current().annotation.solids.size()));
  });
}

void SaveAnnotationFile(ViewerState& state) {
  AnnotationTool& tool = state.editing.annotation;
  Try(state, [&] {
    state.editing.document.SaveAnnotation(tool.file, FileFrame(tool));
    state.Say(tool.file + " saved");
  });
}

void OpenCloudFile(ViewerState& state) {
  AnnotationTool& tool = state.editing.annotation;
  Try(state, [&] {
    tool.cloud = std::make_shared<AnnotationCloud>(
        tool.cloud_file.empty() ? (state.document.last ? CloudOf(*state.document.last) : AnnotationCloud())
                                : ReadCloud(tool.cloud_file, FileFrame(tool).Inverse()));
    tool.chosen.clear();
    state.Say(fmt::format("{} points", tool.cloud->points.size()));
  });
}

bool AlignWithWorld(ViewerState& state) {
  AnnotationTool& tool = state.editing.annotation;
  if (!tool.S_world_map) {
    Try(state, [&] {
      tool.S_world_map =
          AlignToGroundTruth(state.document.file.parent_path(), state.document.info.sequence_path);
    });
  }
  return tool.S_world_map.has_value();
}

}  // namespace sqslam::viewer
