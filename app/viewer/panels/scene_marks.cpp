#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "app/viewer/model/annotation.h"
#include "app/viewer/model/map_objects.h"
#include "app/viewer/panels/panels.h"
#include "app/viewer/state/editing.h"
#include "app/viewer/state/scene_view.h"
#include "app/viewer/widgets/widgets.h"
#include "render/scene/color_scale.h"
#include "slam/geometry/silhouette.h"
#include "slam/util/to_vector.h"

namespace sqslam::viewer {
namespace {

// Draws the edges of all solids as seen by a camera, the selected one `selected_width` wide.
void DrawWires(const EditContext& context, const WindowState& window, const Camera& camera,
               const Rigid3d& T_map_camera, float selected_width,
               const std::function<ImVec2(const Eigen::Vector2d&)>& at) {
  for (const AnnotatedSolid& solid : context.editing.Solids().solids) {
    const bool selected = solid.id == context.editing.annotation.selected;
    const ImU32 color =
        selected ? PaletteOf(window.settings.theme).accent : Packed(context.view.colors(solid.label));
    const float width = (selected ? selected_width : 1.6F) * static_cast<float>(window.scale);
    for (const WireLine& line : ProjectWireframe(solid.solid, camera, T_map_camera)) {
      const std::vector<ImVec2> points = ToVector(line.pixels, at);
      if (line.hidden) {
        Line(points, (color & 0x00FFFFFFU) | 0x60000000U, 1.0F);
      } else {
        Stroke(points, color, width, 1.8F, false, IM_COL32(0, 0, 0, 130));
      }
    }
  }
}

// Draws marks over the scene with the camera of the scene.
class SceneMarks {
 public:
  SceneMarks(const EditContext& context, const WindowState& window, ImVec2 origin)
      : context_(context), window_(window), origin_(origin) {}

  void DrawSelection() const {
    const Selection& selection = context_.selection;
    const auto outline = [&](const SnapshotObject* object, ImU32 color, float width) {
      if (object != nullptr) {
        Stroke(OutlineOf(*object), color, width * scale_, 2.0F, true, IM_COL32(0, 0, 0, 110));
      }
    };
    if (selection.hovered != selection.selected) {
      outline(document_.Object(selection.hovered), palette_.text, 1.2F);
    }
    outline(document_.Object(selection.selected), palette_.accent, 3.0F);
  }

  void DrawInputCamera() const {
    const MapSnapshot* map = document_.Map();
    if (map == nullptr || !map->T_map_camera || map->camera.fx <= 0.0) {
      return;
    }
    const double height = CurrentFrustumHeight(view_.focus, view_.style.cameras.size);
    std::vector<ImVec2> corners;
    for (const Eigen::Vector3d& p_map : FrustumCorners(*map->T_map_camera, map->camera, height)) {
      const auto seen = Project(p_map);
      if (!seen) {
        return;
      }
      corners.push_back(*seen);
    }
    const ImU32 color = Packed(ParseColor(view_.style.cameras.current_color));
    for (std::size_t i = 1; i < corners.size(); ++i) {
      list_->AddLine(corners[0], corners[i], color, 2.0F * scale_);
      list_->AddLine(corners[i], corners[i % 4 + 1], color, 2.0F * scale_);
    }
  }

  // Draws the name of the object on a tag above it.
  void DrawName(const SnapshotObject& object) const {
    const std::vector<ImVec2> polygon = OutlineOf(object);
    if (polygon.empty()) {
      return;
    }
    const auto [left, right] = std::ranges::minmax(polygon, {}, &ImVec2::x);
    const float top = std::ranges::min(polygon, {}, &ImVec2::y).y;
    DrawTag(ObjectName(object), ImVec2(0.5F * (left.x + right.x), top), view_.colors(object.label));
  }

  void DrawMeasurement(const std::vector<Eigen::Vector3d>& points) const {
    std::vector<ImVec2> seen;
    for (const Eigen::Vector3d& point : points) {
      const auto at = Project(point);
      if (!at) {
        return;
      }
      seen.push_back(*at);
    }
    if (seen.size() == 2) {
      Stroke(seen, palette_.accent, 2.0F, 2.0F, false, IM_COL32(0, 0, 0, 140));
      DrawTag(fmt::format("{:.4g} {}", (points[0] - points[1]).norm(), UnitOf(*document_.Map())),
              (seen[0] + seen[1]) * 0.5F, {0.337, 0.706, 0.914});
    }
    for (const ImVec2& p : seen) {
      list_->AddCircleFilled(p, 5.0F, IM_COL32(0, 0, 0, 160));
      list_->AddCircleFilled(p, 3.5F, palette_.accent);
    }
  }

  // Draws a line of text at the lower edge of the scene.
  void DrawHint(const std::string& text) const {
    const float em = ImGui::GetFontSize();
    const ImVec2 size = ImGui::CalcTextSize(text.c_str()) + ImVec2(1.2F, 0.5F) * em;
    const ImVec2 corner =
        origin_ + Vec(0.5 * view_.size.width, view_.size.height) - ImVec2(0.5F * size.x, size.y + em);
    list_->AddRectFilled(corner, corner + size, palette_.surface, 5.0F);
    list_->AddText(corner + ImVec2(0.6F, 0.25F) * em, palette_.text, text.c_str());
  }

  void DrawObjectPoints(const SnapshotObject& object, PointColors colors) const {
    const double brightest = 0.3 * object.superquadric.shape.half_size.mean();  // residual
    const float r = 3.6F * scale_;
    for (const ObjectPoint& point : ObjectPoints(*document_.Map(), object)) {
      const auto at = Seen(point.p_map);
      if (!at) {
        continue;
      }
      const ImU32 color = Packed(
          Viridis(colors == PointColors::kResidual ? std::abs(point.residual) / brightest : point.anomaly));
      if (point.kept) {
        list_->AddCircleFilled(*at, r + 1.0F, IM_COL32(255, 255, 255, 220), 12);
        list_->AddCircleFilled(*at, r, color, 12);
      } else {
        for (const float side : {-1.0F, 1.0F}) {
          const ImVec2 arm(r, side * r);
          list_->AddLine(*at - arm, *at + arm, IM_COL32(255, 255, 255, 220), 4.0F);
          list_->AddLine(*at - arm, *at + arm, color, 2.2F);
        }
      }
    }
  }

  void DrawAnnotation() const {
    DrawWires(context_, window_, pinhole_, T_map_view_, 2.4F,
              [this](const Eigen::Vector2d& pixel) { return OnScreen(pixel); });
    DrawChosen();
    if (const AnnotatedSolid* solid = context_.SelectedSolid(); solid != nullptr && !tool_.lasso) {
      DrawHandles(solid->solid);
    }
  }

 private:
  ImVec2 OnScreen(const Eigen::Vector2d& pixel) const {
    return Vec(origin_.x + pixel.x() + 0.5, origin_.y + pixel.y() + 0.5);
  }
  // Returns the screen position; empty behind the camera.
  std::optional<ImVec2> Project(const Eigen::Vector3d& p_map) const {
    const Eigen::Vector3d p = T_view_map_ * p_map;
    return p.z() > 1e-6 ? std::optional(OnScreen(pinhole_.Project(p))) : std::nullopt;
  }
  // Likewise, but also empty if the point is clipped.
  std::optional<ImVec2> Seen(const Eigen::Vector3d& p_map) const {
    return cut_ && !cut_->Keeps(p_map) ? std::nullopt : Project(p_map);
  }
  std::vector<ImVec2> OnScreen(const std::vector<Eigen::Vector2d>& pixels) const {
    return ToVector(pixels, [this](const Eigen::Vector2d& pixel) { return OnScreen(pixel); });
  }
  std::vector<ImVec2> OutlineOf(const SnapshotObject& object) const {
    return OnScreen(Silhouette(object.superquadric, pinhole_, T_map_view_, 0.1, 64.0));
  }
  // Draws text on a card above `at`.
  void DrawTag(const std::string& text, ImVec2 at, const Eigen::Vector3d& color) const {
    const float em = ImGui::GetFontSize();
    const ImVec2 size = ImGui::CalcTextSize(text.c_str()) + ImVec2(1.7F, 0.5F) * em;
    const float left = origin_.x + 4.0F;
    const float right = left + static_cast<float>(view_.size.width) - size.x - 8.0F;
    const ImVec2 corner(std::clamp(at.x - 0.5F * size.x, left, std::max(left, right)),
                        std::max(at.y - size.y - 0.5F * em, origin_.y + 4.0F));
    list_->AddRectFilled(corner, corner + size, palette_.surface, 5.0F);
    Square(corner + ImVec2(0.75F * em, 0.5F * size.y), 0.3F * em, Packed(color), 3.0F);
    list_->AddText(corner + ImVec2(1.3F, 0.25F) * em, palette_.text, text.c_str());
  }

  void DrawChosen() const {
    if (!tool_.cloud_file.empty() && tool_.cloud) {  // not drawn by the scene: an even subset
      constexpr std::size_t kMaxDrawn = 20000;
      const std::size_t step = tool_.cloud->size() / kMaxDrawn + 1;
      for (std::size_t i = 0; i < tool_.cloud->size(); i += step) {
        if (const auto at = Seen((*tool_.cloud)[i])) {
          Square(*at, 1.0F, IM_COL32(120, 130, 145, 200));
        }
      }
    }
    const float r = 2.6F * scale_;
    for (const int index : tool_.chosen) {
      if (const auto at = Seen((*tool_.cloud)[static_cast<std::size_t>(index)])) {
        list_->AddCircleFilled(*at, r + 1.0F, IM_COL32(0, 0, 0, 150), 8);
        list_->AddCircleFilled(*at, r, palette_.accent, 8);
      }
    }
    if (tool_.outline.size() > 1) {
      Line(OnScreen(tool_.outline), palette_.accent, 1.8F, true);
    }
  }

  void DrawHandles(const Solid& solid) const {
    const auto middle = Project(solid.T_map_object.translation);
    for (const SolidHandle& handle : SolidHandles()) {
      const auto at = Project(HandlePosition(solid, handle));
      if (!at) {
        continue;
      }
      const bool hot = tool_.drag ? tool_.drag->handle == handle : tool_.hovered == handle;
      const float r = (hot ? 6.5F : 5.0F) * scale_;
      const ImU32 fill = hot ? palette_.accent : IM_COL32(255, 255, 255, 255);
      const ImU32 edge = IM_COL32(20, 24, 30, 255);
      if (handle.kind == SolidHandle::Kind::kYaw) {
        if (middle) {
          list_->AddLine(*middle, *at, IM_COL32(255, 255, 255, 150), 1.2F);
        }
        list_->AddCircle(*at, r, edge, 20, 4.5F);
        list_->AddCircle(*at, r, fill, 20, 2.4F);
      } else if (handle.kind == SolidHandle::Kind::kCenter) {
        list_->AddCircleFilled(*at, r + 1.3F, edge, 20);
        list_->AddCircleFilled(*at, r, fill, 20);
      } else {
        Square(*at, r, edge, 1.5F);
        Square(*at, r - 1.3F, fill, 1.0F);
      }
    }
  }

  const EditContext& context_;
  const WindowState& window_;
  ImVec2 origin_;
  const Document& document_ = context_.document;
  const SceneView& view_ = context_.view;
  const AnnotationTool& tool_ = context_.editing.annotation;
  const Palette& palette_ = PaletteOf(window_.settings.theme);
  float scale_ = static_cast<float>(window_.scale);
  ImDrawList* list_ = ImGui::GetWindowDrawList();
  std::optional<ClipPlane> cut_ = view_.Cut();
  Camera pinhole_ = PinholeOf(view_.camera, view_.size);
  Rigid3d T_map_view_ = PoseOf(view_.camera);
  Rigid3d T_view_map_ = T_map_view_.Inverse();
};

}  // namespace

void DrawSceneMarks(const EditContext& context, const WindowState& window, ImVec2 origin) {
  const Document& document = context.document;
  const Selection& selection = context.selection;
  const SceneMarks marks(context, window, origin);
  marks.DrawSelection();
  // During a run the scene is only redrawn with a new map, but the camera moves all the time.
  if (document.run.active && context.view.style.cameras.current) {
    marks.DrawInputCamera();
  }
  if (const auto* named = document.Object(selection.hovered ? selection.hovered : selection.selected)) {
    marks.DrawName(*named);
  }
  if (selection.measuring) {
    marks.DrawMeasurement(selection.measured);
    marks.DrawHint(selection.Hint());
  }
  const SnapshotObject* object = document.Object(selection.selected);
  if (object != nullptr && context.editing.point_colors != PointColors::kNone) {
    marks.DrawObjectPoints(*object, context.editing.point_colors);
  }
  if (document.Map() != nullptr && context.editing.annotation.active) {
    marks.DrawAnnotation();
  }
}

bool AnnotateWithMouse(const EditContext& context, const WindowState& window, ImVec2 origin, bool hovered) {
  AnnotationTool& tool = context.editing.annotation;
  constexpr double kReach = 9.0;  // pixels from a handle at scale 1
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
      context.FinishLasso(io.KeyShift  ? SelectMode::kAdd
                          : io.KeyCtrl ? SelectMode::kRemove
                                       : SelectMode::kReplace);
    }
    return drawing || (hovered && !ImGui::IsAnyMouseDown() && io.MouseWheel == 0.0F);
  }
  if (tool.drag) {
    if (ImGui::IsMouseDown(ImGuiMouseButton_Left)) {
      context.DragTo(mouse);
    } else {
      context.EndDrag();
    }
    return true;
  }
  tool.hovered = hovered ? context.HandleAt(mouse, kReach * window.scale) : std::nullopt;
  if (tool.hovered && ImGui::IsItemActivated() && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
    context.BeginDrag(*tool.hovered, mouse);
    return true;
  }
  const ImVec2 pressed = io.MouseClickedPos[0];
  const bool still = std::hypot(io.MousePos.x - pressed.x, io.MousePos.y - pressed.y) < 3.0F;
  if (hovered && still && ImGui::IsMouseReleased(ImGuiMouseButton_Left)) {
    if (const std::optional<int> solid = context.SolidAt(mouse)) {
      tool.selected = solid;
      return true;
    }
  }
  return tool.hovered.has_value() && io.MouseWheel == 0.0F;
}

void DrawImageMarks(const EditContext& context, const WindowState& window,
                    const std::function<ImVec2(const Eigen::Vector2d&)>& at) {
  const MapSnapshot* map = context.document.Map();
  if (context.editing.annotation.active && map != nullptr && map->T_map_camera) {
    DrawWires(context, window, map->camera, *map->T_map_camera, 2.2F, at);
  }
}

}  // namespace sqslam::viewer
