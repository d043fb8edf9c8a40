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

std::string NameOfStep(const AnnotatedSolid& solid) { return fmt::format("{} {}", solid.label, solid.id); }

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
  context.messages.AddNotice(
      fmt::format("fitted to {} points, rms {:.3g} {}", fit.points, fit.rms, UnitOf(*context.document.last)));
  return fit.solid;
}

// Returns the chosen points or, without any, the points in and close around the solid, without the ground.
Points PointsFor(const AnnotationTool& tool, const Solid& solid) {
  constexpr double kMargin = 1.15;
  std::vector<int> chosen = tool.chosen;
  if (chosen.empty()) {
    chosen = SelectInBox(*tool.cloud, {solid.T_map_object, kMargin * solid.half_size});
  }
  if (tool.ground && tool.standing) {
    chosen = AboveGround(*tool.cloud, chosen, *tool.ground, 0.04 * solid.half_size.mean());
  }
  return PointsAt(*tool.cloud, chosen);
}

}  // namespace

void EditContext::PrepareAnnotation() const {
  const MapSnapshotPtr& map = document.last;
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
    tool.file = (document.file.parent_path() / "objects_gt.json").string();
  }
}

const AnnotatedSolid* EditContext::SelectedSolid() const {
  return tool.selected ? editing.Solids().Find(*tool.selected) : nullptr;
}

void EditContext::AddSolid(SolidKind kind) const {
  messages.Try([&] {
    AnnotatedSolid solid;
    solid.label = tool.label;
    if (!tool.chosen.empty()) {
      solid.solid = Fit(*this, kind, PointsAt(*tool.cloud, tool.chosen));
    } else {
      const double size = 0.12 * view.focus.radius;
      solid.solid = UprightSolid(kind, PlaceInView(*this), 0.0, Eigen::Vector3d(size, size, size));
      if (tool.ground && tool.standing) {
        SnapToGround(solid.solid, *tool.ground, GroundSnap::kMove);
      }
    }
    Do(*this, "Add " + std::string(NameOf(kind)),
       [&](Annotation& annotation) { tool.selected = annotation.Add(solid); });
    tool.chosen.clear();
  });
}

void EditContext::AddSolidOf(const SnapshotObject& object) const {
  AnnotatedSolid solid;
  solid.label = object.label;
  solid.solid = Solid::FromSuperquadric(object.superquadric);
  Do(*this, "Add " + object.label, [&](Annotation& annotation) { tool.selected = annotation.Add(solid); });
}

void EditContext::RemoveSolid() const {
  if (const AnnotatedSolid* solid = SelectedSolid()) {
    const int id = solid->id;
    Do(*this, "Remove " + NameOfStep(*solid), [&](Annotation& annotation) { annotation.Remove(id); });
    tool.selected.reset();
  }
}

void EditContext::ChangeSolid(const AnnotatedSolid& solid) const {
  Do(
      *this, "Change " + NameOfStep(solid), [&](Annotation& annotation) { annotation.Replace(solid); },
      fmt::format("solid {}", solid.id));
}

void EditContext::StandOnGround() const {
  const AnnotatedSolid* solid = SelectedSolid();
  const std::optional<double> ground = tool.ground;
  if (solid == nullptr || !ground) {
    return;
  }
  AnnotatedSolid moved = *solid;
  SnapToGround(moved.solid, *ground, GroundSnap::kMove);
  Replace(*this, "Put " + NameOfStep(moved) + " on the ground", moved);
}

void EditContext::FitSolid() const {
  const AnnotatedSolid* solid = SelectedSolid();
  if (solid == nullptr || !tool.cloud) {
    return;
  }
  messages.Try([&] {
    AnnotatedSolid fitted = *solid;
    fitted.solid = Fit(*this, solid->solid.kind, PointsFor(tool, solid->solid));
    Replace(*this, "Fit " + NameOfStep(fitted), fitted);
  });
}

void EditContext::FinishLasso(SelectMode mode) const {
  const std::vector<Eigen::Vector2d> outline = std::exchange(tool.outline, {});
  if (!tool.cloud || outline.size() < 3) {
    return;
  }
  std::vector<int> inside =
      SelectInLasso(*tool.cloud, outline, PinholeOf(view.camera, view.size), PoseOf(view.camera));
  if (const std::optional<ClipPlane> cut = view.Cut()) {
    std::erase_if(inside,
                  [&](int index) { return !cut->Keeps((*tool.cloud)[static_cast<std::size_t>(index)]); });
  }
  tool.chosen = Combine(tool.chosen, inside, mode);
}

std::optional<SolidHandle> EditContext::HandleAt(const Eigen::Vector2d& pixel, double reach) const {
  const AnnotatedSolid* solid = SelectedSolid();
  std::optional<SolidHandle> best;
  if (solid == nullptr) {
    return best;
  }
  const Camera camera = PinholeOf(view.camera, view.size);
  const Rigid3d T_view_map = PoseOf(view.camera).Inverse();
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

std::optional<int> EditContext::SolidAt(const Eigen::Vector2d& pixel) const {
  const Ray ray = RayAt(view, pixel);
  std::optional<int> best;
  double nearest = std::numeric_limits<double>::infinity();
  for (const AnnotatedSolid& solid : editing.Solids().solids) {
    const std::optional<double> at = HitDistance(ray, AsSuperquadric(solid.solid));
    if (at && *at < nearest) {
      nearest = *at;
      best = solid.id;
    }
  }
  return best;
}

void EditContext::BeginDrag(const SolidHandle& handle, const Eigen::Vector2d& pixel) const {
  if (const AnnotatedSolid* solid = SelectedSolid()) {
    editing.document.EndGroup();
    tool.drag = AnnotationTool::Drag{handle, *solid, RayAt(view, pixel)};
  }
}

void EditContext::DragTo(const Eigen::Vector2d& pixel) const {
  const std::optional<AnnotationTool::Drag>& drag = tool.drag;
  if (drag) {
    AnnotatedSolid changed = drag->start;
    changed.solid = DragHandle(drag->start.solid, drag->handle, drag->from, RayAt(view, pixel));
    ChangeSolid(changed);
  }
}

void EditContext::EndDrag() const {
  tool.drag.reset();
  editing.document.EndGroup();
}

void EditContext::OpenAnnotationFile() const {
  messages.Try([&] {
    editing.document.OpenAnnotation(tool.file, FileFrame(tool));
    tool.selected.reset();
    messages.AddNotice(fmt::format("{} solids read", editing.Solids().solids.size()));
  });
}

void EditContext::SaveAnnotationFile() const {
  messages.Try([&] {
    editing.document.SaveAnnotation(tool.file, FileFrame(tool));
    messages.AddNotice(tool.file + " saved");
  });
}

void EditContext::OpenCloudFile() const {
  messages.Try([&] {
    tool.cloud = std::make_shared<Points>(tool.cloud_file.empty()
                                              ? (document.last ? PositionsOf(*document.last) : Points())
                                              : ReadPoints(tool.cloud_file, FileFrame(tool).Inverse()));
    tool.chosen.clear();
    messages.AddNotice(fmt::format("{} points", tool.cloud->size()));
  });
}

bool EditContext::AlignWithWorld() const {
  if (!tool.S_world_map) {
    messages.Try([&] {
      tool.S_world_map = AlignToGroundTruth(document.file.parent_path(), document.info.sequence_path);
    });
  }
  return tool.S_world_map.has_value();
}

}  // namespace sqslam::viewer
