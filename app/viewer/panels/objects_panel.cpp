#include <fmt/format.h>
#include <imgui.h>

#include <numbers>

#include "app/viewer/panels/panels.h"
#include "app/viewer/widgets.h"

namespace sqslam::viewer {
namespace {

class ObjectsPanel : public Panel {
 public:
  Place Where() const override { return Place::kSide; }
  std::string Title() const override { return "Objects"; }

  void Draw(ViewerState& state) override {
    const MapSnapshot* map = state.Map();
    if (map == nullptr || map->objects.empty()) {
      ImGui::TextDisabled(map == nullptr ? "No map is open." : "The map holds no objects yet.");
      return;
    }
    const SnapshotObject* selected = state.Object(state.selected);
    const float details = selected != nullptr ? 13.0F * ImGui::GetTextLineHeightWithSpacing() : 0.0F;
    DrawList(
        state, *map,
        std::max(6.0F * ImGui::GetTextLineHeightWithSpacing(), ImGui::GetContentRegionAvail().y - details));
    if (selected != nullptr) {
      DrawDetails(*selected);
    }
  }

 private:
  static void DrawList(ViewerState& state, const MapSnapshot& map, float height) {
    if (!ImGui::BeginTable("objects", 3, ImGuiTableFlags_ScrollY | ImGuiTableFlags_RowBg,
                           ImVec2(0.0F, height))) {
      return;
    }
    ImGui::TableSetupScrollFreeze(0, 1);
    ImGui::TableSetupColumn("object", ImGuiTableColumnFlags_WidthStretch);
    ImGui::TableSetupColumn("seen", ImGuiTableColumnFlags_WidthFixed, 3.4F * ImGui::GetFontSize());
    ImGui::TableSetupColumn("points", ImGuiTableColumnFlags_WidthFixed, 3.4F * ImGui::GetFontSize());
    ImGui::TableHeadersRow();
    for (const SnapshotObject& object : map.objects) {
      ImGui::TableNextRow();
      ImGui::TableNextColumn();
      ImGui::PushID(object.id);
      Swatch(state.colors(object.label));
      const bool selected = state.selected == object.id;
      if (ImGui::Selectable(ObjectName(object).c_str(), selected, ImGuiSelectableFlags_SpanAllColumns)) {
        state.selected = selected ? std::nullopt : std::optional(object.id);
      }
      if (ImGui::IsItemHovered()) {
        state.pointed = object.id;
      }
      ImGui::TableNextColumn();
      ImGui::Text("%d", object.observations);
      ImGui::TableNextColumn();
      ImGui::Text("%d", object.points);
      ImGui::PopID();
    }
    ImGui::EndTable();
  }

  static void DrawDetails(const SnapshotObject& object) {
    const Superquadric& shape = object.superquadric.shape;
    const Eigen::Vector3d& at = object.superquadric.T_map_object.translation;
    Heading(ObjectName(object).c_str());
    Row("centre", fmt::format("{:.3f}  {:.3f}  {:.3f}", at.x(), at.y(), at.z()));
    Row("half sizes",
        fmt::format("{:.3f}  {:.3f}  {:.3f}", shape.half_size.x(), shape.half_size.y(), shape.half_size.z()));
    Row("exponents", fmt::format("{:.2f}  {:.2f}", shape.e1, shape.e2));
    Row("yaw", fmt::format("{:.1f}\u00b0", object.yaw * 180.0 / std::numbers::pi));
    Row("detector score", fmt::format("{:.2f}", object.score));
    Row("agrees with boxes", fmt::format("{:.0f} %", 100.0 * object.fit.box_agreement));
    Row("points off surface", fmt::format("{:.4f}", object.fit.point_rms));
  }
};

}  // namespace

PanelPtr MakeObjectsPanel() { return std::make_unique<ObjectsPanel>(); }

}  // namespace sqslam::viewer
