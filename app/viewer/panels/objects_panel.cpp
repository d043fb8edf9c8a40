#include <fmt/format.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "app/viewer/model/object_table.h"
#include "app/viewer/panels/panels.h"
#include "app/viewer/state/edit_actions.h"
#include "app/viewer/widgets/widgets.h"

namespace sqslam::viewer {
namespace {

// The table of objects with its filter, and what can be done to the selected one.
class ObjectsPanel : public Panel {
 public:
  Place Where() const override { return Place::kSide; }
  std::string Title() const override { return "Objects"; }

  void Draw(ViewerState& state) override {
    if (state.Map() == nullptr) {
      ImGui::TextDisabled("No map is open.");
      return;
    }
    MakeRows(state);
    DrawFilter(state);
    const SnapshotObject* selected = state.Object(state.selected);
    const float bar = selected != nullptr ? ImGui::GetFrameHeightWithSpacing() : 0.0F;
    DrawTable(state, std::max(ImGui::GetContentRegionAvail().y - bar, 3.0F * ImGui::GetFrameHeight()));
    if (selected != nullptr) {
      DrawActions(state, selected->id);
    }
  }

 private:
  // Rows of the map as edited, with what is hidden.
  void MakeRows(const ViewerState& state) {
    const ShownFramePtr& raw = state.editing.raw;
    const ObjectEdits& edits = state.editing.document.Current().edits;
    if (!raw || !raw->map || (raw->map == map_ && edits == edits_ && sorted_by_ == order_)) {
      return;
    }
    map_ = raw->map;
    edits_ = edits;
    sorted_by_ = order_;
    rows_ = ObjectRows(*Apply(edits, *map_, HiddenObjects::kKeep), edits);
    SortRows(rows_, order_.column, order_.ascending);
  }

  void DrawFilter(const ViewerState& state) {
    const auto shown = std::count_if(rows_.begin(), rows_.end(),
                                     [this](const ObjectRow& row) { return filter_.Shows(row); });
    const std::string count = static_cast<std::size_t>(shown) == rows_.size()
                                  ? fmt::format("{}", rows_.size())
                                  : fmt::format("{} of {}", shown, rows_.size());
    const float width = ImGui::CalcTextSize("00 of 00").x + ImGui::GetFontSize();
    ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x - width);
    if (ImGui::InputTextWithHint("##filter", "Filter: cup, seen > 50, e1 < 0.3", &text_)) {
      filter_ = RowFilter(text_);
    }
    Tip("Words of name, label or number; comparisons with observations, points, score, ax, ay, az, e1, e2, "
        "yaw, "
        "residual, agreement");
    ImGui::SameLine();
    ImGui::TextDisabled("%s", count.c_str());
    if (!filter_.Problem().empty()) {
      ImGui::PushStyleColor(ImGuiCol_Text, PaletteOf(state.theme).bad);
      ImGui::TextWrapped("%s", filter_.Problem().c_str());
      ImGui::PopStyleColor();
    }
  }

  void DrawTable(ViewerState& state, float height) {
    constexpr std::array<ObjectColumn, 11> kShown = {
        ObjectColumn::kName,  ObjectColumn::kObservations, ObjectColumn::kPoints,   ObjectColumn::kScore,
        ObjectColumn::kE1,    ObjectColumn::kE2,           ObjectColumn::kSizeX,    ObjectColumn::kSizeY,
        ObjectColumn::kSizeZ, ObjectColumn::kResidual,     ObjectColumn::kAgreement};
    const ImGuiTableFlags flags = ImGuiTableFlags_ScrollX | ImGuiTableFlags_ScrollY | ImGuiTableFlags_RowBg |
                                  ImGuiTableFlags_Sortable | ImGuiTableFlags_Resizable |
                                  ImGuiTableFlags_Hideable | ImGuiTableFlags_NoSavedSettings;
    if (!ImGui::BeginTable("objects", static_cast<int>(kShown.size()), flags, ImVec2(0.0F, height))) {
      return;
    }
    const float em = ImGui::GetFontSize();
    ImGui::TableSetupScrollFreeze(1, 1);
    for (const ColumnInfo& info : ObjectColumns()) {
      if (std::find(kShown.begin(), kShown.end(), info.column) == kShown.end()) {
        continue;
      }
      const bool name = info.column == ObjectColumn::kName;
      const bool counts = info.column == ObjectColumn::kObservations || info.column == ObjectColumn::kPoints;
      ImGui::TableSetupColumn(info.title.c_str(),
                              ImGuiTableColumnFlags_WidthFixed |
                                  (counts ? ImGuiTableColumnFlags_PreferSortDescending : 0) |
                                  (name ? ImGuiTableColumnFlags_NoHide : 0),
                              name                    ? 9.2F * em
                              : info.title.size() > 5 ? 4.9F * em
                                                      : 3.6F * em,
                              static_cast<ImGuiID>(info.column));
    }
    TakeOrder();
    DrawHeader();
    for (const ObjectRow& row : rows_) {
      if (filter_.Shows(row)) {
        DrawRow(state, row);
      }
    }
    ImGui::EndTable();
  }

  static void DrawActions(ViewerState& state, int id) {
    if (ImGui::Button("Hide")) {
      HideObject(state, id, true);
    }
    Tip("Leaves it out of pictures, not of files; a click on its row shows it again");
    ImGui::SameLine();
    if (ImGui::Button("Delete")) {
      DeleteObject(state, id);
    }
    Tip("Takes it out of the edited map (Delete). The recording stays as it is");
  }

  void TakeOrder() {
    ImGuiTableSortSpecs* specs = ImGui::TableGetSortSpecs();
    if (specs != nullptr && specs->SpecsDirty && specs->SpecsCount > 0) {
      order_ = {static_cast<ObjectColumn>(specs->Specs[0].ColumnUserID),
                specs->Specs[0].SortDirection == ImGuiSortDirection_Ascending};
      specs->SpecsDirty = false;
    }
  }

  static void DrawHeader() {
    ImGui::TableNextRow(ImGuiTableRowFlags_Headers);
    int column = 0;
    for (const ColumnInfo& info : ObjectColumns()) {
      if (info.column == ObjectColumn::kId || info.column == ObjectColumn::kLabel ||
          info.column == ObjectColumn::kYaw) {
        continue;
      }
      ImGui::TableSetColumnIndex(column++);
      ImGui::TableHeader(info.title.c_str());
      Tip(info.help.c_str());
    }
  }

  static void DrawRow(ViewerState& state, const ObjectRow& row) {
    ImGui::TableNextRow();
    ImGui::PushID(row.id);
    if (row.hidden) {
      ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
    }
    ImGui::TableNextColumn();
    Swatch(state.colors(row.label), row.hidden);
    const bool selected = state.selected == row.id;
    std::string name = row.name;
    if (name == row.label) {
      std::replace(name.begin(), name.end(), '_', ' ');
      name += fmt::format(" {}", row.id);
    }
    if (ImGui::Selectable(name.c_str(), selected,
                          ImGuiSelectableFlags_SpanAllColumns | ImGuiSelectableFlags_AllowDoubleClick)) {
      if (row.hidden) {
        HideObject(state, row.id, false);
        state.selected = row.id;
      } else if (ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) {
        state.selected = row.id;
        state.to_front = "Inspector";
      } else {
        state.selected = selected ? std::nullopt : std::optional(row.id);
      }
    }
    if (ImGui::IsItemHovered()) {
      state.pointed = row.id;
      if (row.hidden) {
        ImGui::SetTooltip("Hidden; a click shows it again");
      }
    }
    for (const ColumnInfo& info : ObjectColumns()) {
      if (info.is_number && info.column != ObjectColumn::kId && info.column != ObjectColumn::kYaw) {
        ImGui::TableNextColumn();
        const std::string cell = CellText(row, info.column);
        const float room = ImGui::GetContentRegionAvail().x - ImGui::CalcTextSize(cell.c_str()).x;
        ImGui::SetCursorPosX(ImGui::GetCursorPosX() + std::max(0.0F, room - 0.3F * ImGui::GetFontSize()));
        ImGui::TextUnformatted(cell.c_str());
      }
    }
    if (row.hidden) {
      ImGui::PopStyleColor();
    }
    ImGui::PopID();
  }

  struct Order {
    ObjectColumn column = ObjectColumn::kName;
    bool ascending = true;
    bool operator==(const Order&) const = default;
  };

  std::string text_;
  RowFilter filter_;
  Order order_, sorted_by_;
  MapSnapshotPtr map_;
  ObjectEdits edits_;
  std::vector<ObjectRow> rows_;
};

}  // namespace

PanelPtr MakeObjectsPanel() { return std::make_unique<ObjectsPanel>(); }

}  // namespace sqslam::viewer
