#include "app/viewer/panels/scene_marks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "app/viewer/model/object_points.h"
#include "app/viewer/model/wireframe.h"
#include "app/viewer/state/annotation_tool.h"
#include "app/viewer/state/camera_control.h"
#include "app/viewer/widgets/theme.h"
#include "app/viewer/widgets/widgets.h"

namespace sqslam::viewer {
namespace {

// Projects points of the map onto the screen.
class SceneProjection {
 public:
  SceneProjection(const ViewerState& state, ImVec2 origin)
      : cut(CutOf(state)),
        pinhole(PinholeOf(state.view.camera, state.scene_size)),
        T_map_view(PoseOf(state.view.camera)),
        T_view_map_(T_map_view.Inverse()),
        origin_(origin) {}

  std::optional<ImVec2> operator()(const Eigen::Vector3d& p_map) const {
    const Eigen::Vector3d p = T_view_map_ * p_map;
    if (p.z() <= 0.0) {
      return std::nullopt;
    }
    return OnScreen(pinhole.Project(p));
  }
  ImVec2 OnScreen(const Eigen::Vector2d& pixel) const {
    return {origin_.x + static_cast<float>(pixel.x() + 0.5), origin_.y + static_cast<float>(pixel.y() + 0.5)};
  }

  // The same for points of the scene; nowhere what is cut away.
  std::optional<ImVec2> Seen(const Eigen::Vector3d& p_map) const {
    return cut && !cut->Keeps(p_map) ? std::nullopt : (*this)(p_map);
  }

  std::optional<ClipPlane> cut;
  Camera pinhole;
  Rigid3d T_map_view;

 private:
  Rigid3d T_view_map_;
  ImVec2 origin_;
};

// Viridis at five places: even to the eye and to any colour vision.
Eigen::Vector3d Ramp(double share) {
  static const std::array<Eigen::Vector3d, 5> kStops = {{{0.267, 0.005, 0.329},
                                                         {0.230, 0.322, 0.546},
                                                         {0.128, 0.567, 0.551},
                                                         {0.369, 0.789, 0.383},
                                                         {0.993, 0.906, 0.144}}};
  const double at = std::clamp(share, 0.0, 1.0) * 4.0;
  const auto low = static_cast<std::size_t>(std::min(3.0, std::floor(at)));
  return kStops[low] + (at - static_cast<double>(low)) * (kStops[low + 1] - kStops[low]);
}

void DrawObjectPoints(const ViewerState& state, const SceneProjection& project) {
  const SnapshotObject* object = state.Object(state.selected);
  if (object == nullptr || state.editing.point_colors == PointColors::kNone) {
    return;
  }
  const bool by_residual = state.editing.point_colors == PointColors::kResidual;
  const double scale = 0.3 * object->superquadric.shape.half_size.mean();  // the brightest residual
  ImDrawList* list = ImGui::GetWindowDrawList();
  const float r = 3.6F * static_cast<float>(state.ui_scale);
  for (const ObjectPoint& point : ObjectPoints(*state.Map(), *object)) {
    const auto at = project.Seen(point.p_map);
    if (!at) {
      continue;
    }
    const ImU32 color = Packed(Ramp(by_residual ? std::abs(point.residual) / scale : point.anomaly));
    if (point.kept) {
      list->AddCircleFilled(*at, r + 1.0F, IM_COL32(255, 255, 255, 220), 12);
      list->AddCircleFilled(*at, r, color, 12);
    } else {
      for (const float side : {-1.0F, 1.0F}) {
        const ImVec2 a(at->x - r, at->y - side * r);
        const ImVec2 b(at->x + r, at->y + side * r);
        list->AddLine(a, b, IM_COL32(255, 255, 255, 220), 4.0F);
        list->AddLine(a, b, color, 2.2F);
      }
    }
  }
}

void DrawWires(const std::vector<WireLine>& lines, ImU32 color, float width,
               const std::function<ImVec2(const Eigen::Vector2d&)>& at) {
  ImDrawList* list = ImGui::GetWindowDrawList();
  for (const WireLine& line : lines) {
    std::vector<ImVec2> points;
    for (const Eigen::Vector2d& pixel : line.pixels) {
      points.push_back(at(pixel));
    }
    const int count = static_cast<int>(points.size());
    if (!line.hidden) {
      list->AddPolyline(points.data(), count, IM_COL32(0, 0, 0, 130), 0, width + 1.8F);
    }
    list->AddPolyline(points.data(), count, line.hidden ? (color & 0x00FFFFFFU) | 0x60000000U : color, 0,
                      line.hidden ? 1.0F : width);
  }
}

void DrawChosen(const ViewerState& state, const SceneProjection& project) {
  const AnnotationTool& tool = state.editing.annotation;
  ImDrawList* list = ImGui::GetWindowDrawList();
  const Palette& palette = PaletteOf(state.theme);
  const float r = 2.6F * static_cast<float>(state.ui_scale);
  if (!tool.cloud_file.empty() &&
      tool.cloud) {  // a cloud of its own is not in the scene: an even share of it
    constexpr std::size_t kMostDrawn = 20000;
    const std::size_t step = tool.cloud->points.size() / kMostDrawn + 1;
    for (std::size_t i = 0; i < tool.cloud->points.size(); i += step) {
      if (const auto at = project.Seen(tool.cloud->points[i])) {
        list->AddRectFilled(ImVec2(at->x - 1.0F, at->y - 1.0F), ImVec2(at->x + 1.0F, at->y + 1.0F),
                            IM_COL32(120, 130, 145, 200));
      }
    }
  }
  for (const int index : tool.chosen) {
    if (const auto at = project.Seen(tool.cloud->points[static_cast<std::size_t>(index)])) {
      list->AddCircleFilled(*at, r + 1.0F, IM_COL32(0, 0, 0, 150), 8);
      list->AddCircleFilled(*at, r, palette.accent, 8);
    }
  }
  if (tool.outline.size() > 1) {
    std::vector<ImVec2> outline;
    for (const Eigen::Vector2d& pixel : tool.outline) {
      outline.push_back(project.OnScreen(pixel));
    }
    list->AddPolyline(outline.data(), static_cast<int>(outline.size()), palette.accent, ImDrawFlags_Closed,
                      1.8F);
  }
}

void DrawHandles(const ViewerState& state, const SceneProjection& project, const Solid& solid) {
  const AnnotationTool& tool = state.editing.annotation;
  ImDrawList* list = ImGui::GetWindowDrawList();
  const Palette& palette = PaletteOf(state.theme);
  const auto scale = static_cast<float>(state.ui_scale);
  const auto middle = project(solid.T_map_object.translation);
  for (const SolidHandle& handle : SolidHandles()) {
    const auto at = project(HandlePosition(solid, handle));
    if (!at) {
      continue;
    }
    const bool hot = tool.drag ? tool.drag->handle == handle : tool.hovered == handle;
    const float r = (hot ? 6.5F : 5.0F) * scale;
    const ImU32 fill = hot ? palette.accent : IM_COL32(255, 255, 255, 255);
    const ImU32 edge = IM_COL32(20, 24, 30, 255);
    if (handle.kind == SolidHandle::Kind::kYaw) {
      if (middle) {
        list->AddLine(*middle, *at, IM_COL32(255, 255, 255, 150), 1.2F);
      }
      list->AddCircle(*at, r, edge, 20, 4.5F);
      list->AddCircle(*at, r, fill, 20, 2.4F);
    } else if (handle.kind == SolidHandle::Kind::kCenter) {
      list->AddCircleFilled(*at, r + 1.3F, edge, 20);
      list->AddCircleFilled(*at, r, fill, 20);
    } else {
      list->AddRectFilled(ImVec2(at->x - r, at->y - r), ImVec2(at->x + r, at->y + r), edge, 1.5F);
      list->AddRectFilled(ImVec2(at->x - r + 1.3F, at->y - r + 1.3F),
                          ImVec2(at->x + r - 1.3F, at->y + r - 1.3F), fill, 1.0F);
    }
  }
}

}  // namespace

void DrawSceneMarks(const ViewerState& state, ImVec2 origin) {
  if (state.Map() == nullptr) {
    return;
  }
  const SceneProjection project(state, origin);
  DrawObjectPoints(state, project);
  const AnnotationTool& tool = state.editing.annotation;
  if (!tool.active) {
    return;
  }
  const auto scale = static_cast<float>(state.ui_scale);
  for (const AnnotatedSolid& solid : state.editing.document.Current().annotation.solids) {
    const bool selected = solid.id == tool.selected;
    DrawWires(ProjectWireframe(solid.solid, project.pinhole, project.T_map_view),
              selected ? PaletteOf(state.theme).accent : Packed(state.colors(solid.label)),
              (selected ? 2.4F : 1.6F) * scale,
              [&](const Eigen::Vector2d& pixel) { return project.OnScreen(pixel); });
  }
  DrawChosen(state, project);
  if (const AnnotatedSolid* solid = SelectedSolid(state); solid != nullptr && !tool.lasso) {
    DrawHandles(state, project, solid->solid);
  }
}

bool AnnotateWithMouse(ViewerState& state, ImVec2 origin, bool hovered) {
  AnnotationTool& tool = state.editing.annotation;
  if (!tool.active) {
    return false;
  }
  const ImGuiIO& io = ImGui::GetIO();
  const Eigen::Vector2d mouse(io.MousePos.x - origin.x - 0.5F, io.MousePos.y - origin.y - 0.5F);
  if (tool.lasso) {
    const bool drawing = ImGui::IsItemActive() && ImGui::IsMouseDown(ImGuiMouseButton_Left);
    if (drawing && (tool.outline.empty() || (tool.outline.back() - mouse).norm() > 2.0)) {
      tool.outline.push_back(mouse);
    }
    if (!drawing && !tool.outline.empty()) {
      FinishLasso(state, io.KeyShift  ? SelectMode::kAdd
                         : io.KeyCtrl ? SelectMode::kRemove
                                      : SelectMode::kReplace);
    }
    return drawing || (hovered && !ImGui::IsAnyMouseDown() && io.MouseWheel == 0.0F);
  }
  if (tool.drag) {
    if (ImGui::IsMouseDown(ImGuiMouseButton_Left)) {
      DragTo(state, mouse);
    } else {
      EndDrag(state);
    }
    return true;
  }
  tool.hovered = hovered ? HandleAt(state, mouse) : std::nullopt;
  if (tool.hovered && ImGui::IsItemActivated() && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
    BeginDrag(state, *tool.hovered, mouse);
    return true;
  }
  const ImVec2 pressed = io.MouseClickedPos[0];
  const bool still = std::hypot(io.MousePos.x - pressed.x, io.MousePos.y - pressed.y) < 3.0F;
  if (hovered && still && ImGui::IsMouseReleased(ImGuiMouseButton_Left)) {
    if (const std::optional<int> solid = SolidAt(state, mouse)) {
      tool.selected = solid;
      return true;
    }
  }
  return tool.hovered.has_value() && io.MouseWheel == 0.0F;
}

void DrawImageMarks(const ViewerState& state, const std::function<ImVec2(double, double)>& at) {
  const AnnotationTool& tool = state.editing.annotation;
  const MapSnapshot* map = state.Map();
  if (!tool.active || map == nullptr || !map->T_map_camera) {
    return;
  }
  for (const AnnotatedSolid& solid : state.editing.document.Current().annotation.solids) {
    const bool selected = solid.id == tool.selected;
    DrawWires(ProjectWireframe(solid.solid, map->camera, *map->T_map_camera),
              selected ? PaletteOf(state.theme).accent : Packed(state.colors(solid.label)),
              (selected ? 2.2F : 1.6F) * static_cast<float>(state.ui_scale),
              [&](const Eigen::Vector2d& pixel) { return at(pixel.x(), pixel.y()); });
  }
}

}  // namespace sqslam::viewer
