#include "app/viewer/panels/scene_overlay.h"

#include <algorithm>
#include <cstdio>

#include "app/viewer/state/camera_control.h"
#include "app/viewer/widgets/widgets.h"
#include "slam/geometry/silhouette.h"

namespace sqslam::viewer {

std::vector<ImVec2> SceneOverlay::OutlineOf(const SnapshotObject& object) const {
  const Camera pinhole = PinholeOf(state_.view.camera, size_);
  std::vector<ImVec2> polygon;
  for (const Eigen::Vector2d& p :
       Silhouette(object.superquadric, pinhole, PoseOf(state_.view.camera), 0.1, 64.0)) {
    polygon.emplace_back(origin_.x + static_cast<float>(p.x() + 0.5),
                         origin_.y + static_cast<float>(p.y() + 0.5));
  }
  return polygon;
}

void SceneOverlay::Outline(const SnapshotObject* object, ImU32 color, float width) const {
  if (object == nullptr) {
    return;
  }
  const std::vector<ImVec2> polygon = OutlineOf(*object);
  ImDrawList* list = ImGui::GetWindowDrawList();
  const int count = static_cast<int>(polygon.size());
  list->AddPolyline(polygon.data(), count, IM_COL32(0, 0, 0, 110), ImDrawFlags_Closed, width + 2.0F);
  list->AddPolyline(polygon.data(), count, color, ImDrawFlags_Closed, width);
}

void SceneOverlay::Name(const SnapshotObject* object) const {
  if (object == nullptr) {
    return;
  }
  const std::vector<ImVec2> polygon = OutlineOf(*object);
  if (polygon.empty()) {
    return;
  }
  ImVec2 top = polygon.front();
  float left = top.x;
  float right = top.x;
  for (const ImVec2& p : polygon) {
    top.y = std::min(top.y, p.y);
    left = std::min(left, p.x);
    right = std::max(right, p.x);
  }
  Tag(ObjectName(*object), ImVec2(0.5F * (left + right), top.y), state_.colors(object->label));
}

void SceneOverlay::Tag(const std::string& text, ImVec2 at, const Eigen::Vector3d& color) const {
  const Palette& palette = PaletteOf(state_.theme);
  ImDrawList* list = ImGui::GetWindowDrawList();
  const float em = ImGui::GetFontSize();
  const ImVec2 size = ImGui::CalcTextSize(text.c_str());
  const float width = size.x + 1.7F * em;
  const float height = size.y + 0.5F * em;
  const float x =
      std::clamp(at.x - 0.5F * width, origin_.x + 4.0F,
                 std::max(origin_.x + 4.0F, origin_.x + static_cast<float>(size_.width) - width - 4.0F));
  const float y = std::max(at.y - height - 0.5F * em, origin_.y + 4.0F);
  list->AddRectFilled(ImVec2(x, y), ImVec2(x + width, y + height), palette.surface, 5.0F);
  list->AddRectFilled(ImVec2(x + 0.45F * em, y + 0.5F * height - 0.3F * em),
                      ImVec2(x + 1.05F * em, y + 0.5F * height + 0.3F * em), Packed(color), 3.0F);
  list->AddText(ImVec2(x + 1.3F * em, y + 0.25F * em), palette.text, text.c_str());
}

void SceneOverlay::InputCamera() const {
  const MapSnapshot* map = state_.Map();
  if (map == nullptr || !map->T_map_camera || map->camera.fx <= 0.0) {
    return;
  }
  const Camera& lens = map->camera;
  const double height =
      3.2 * state_.view.style.cameras.size * std::min(state_.focus.radius, state_.focus.view_depth);
  const double depth = height * lens.fy / lens.height;
  std::vector<ImVec2> corners;
  const Camera pinhole = PinholeOf(state_.view.camera, size_);
  const Rigid3d T_view_map = PoseOf(state_.view.camera).Inverse();
  for (const Eigen::Vector2d& pixel :
       {Eigen::Vector2d(lens.cx, lens.cy), Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(lens.width, 0.0),
        Eigen::Vector2d(lens.width, lens.height), Eigen::Vector2d(0.0, lens.height)}) {
    const double along = corners.empty() ? 0.0 : depth;  // the first is the eye
    const Eigen::Vector3d p = T_view_map * (*map->T_map_camera * (along * lens.Unproject(pixel)));
    if (p.z() <= 1e-6) {
      return;
    }
    const Eigen::Vector2d seen = pinhole.Project(p);
    corners.emplace_back(origin_.x + static_cast<float>(seen.x() + 0.5),
                         origin_.y + static_cast<float>(seen.y() + 0.5));
  }
  ImDrawList* list = ImGui::GetWindowDrawList();
  const ImU32 color = Packed(ParseColor(state_.view.style.cameras.current_color));
  const float width = 2.0F * static_cast<float>(state_.ui_scale);
  for (std::size_t i = 1; i < corners.size(); ++i) {
    list->AddLine(corners[0], corners[i], color, width);
    list->AddLine(corners[i], corners[i % 4 + 1], color, width);
  }
}

void SceneOverlay::Measurement() const {
  if (!state_.measurement.active) {
    return;
  }
  const Camera pinhole = PinholeOf(state_.view.camera, size_);
  const Rigid3d T_view_map = PoseOf(state_.view.camera).Inverse();
  const Palette& palette = PaletteOf(state_.theme);
  ImDrawList* list = ImGui::GetWindowDrawList();
  std::vector<ImVec2> seen;
  for (const Eigen::Vector3d& point : state_.measurement.points) {
    const Eigen::Vector3d p = T_view_map * point;
    if (p.z() <= 0.0) {
      return;
    }
    const Eigen::Vector2d pixel = pinhole.Project(p);
    seen.emplace_back(origin_.x + static_cast<float>(pixel.x() + 0.5),
                      origin_.y + static_cast<float>(pixel.y() + 0.5));
  }
  if (seen.size() == 2) {
    list->AddLine(seen[0], seen[1], IM_COL32(0, 0, 0, 140), 4.0F);
    list->AddLine(seen[0], seen[1], palette.accent, 2.0F);
    const double length = (state_.measurement.points[0] - state_.measurement.points[1]).norm();
    char text[64];
    std::snprintf(text, sizeof text, "%.4g map units", length);
    Tag(text, ImVec2(0.5F * (seen[0].x + seen[1].x), 0.5F * (seen[0].y + seen[1].y)), {0.337, 0.706, 0.914});
  }
  for (const ImVec2& p : seen) {
    list->AddCircleFilled(p, 5.0F, IM_COL32(0, 0, 0, 160));
    list->AddCircleFilled(p, 3.5F, palette.accent);
  }
}

}  // namespace sqslam::viewer
