#include <fmt/format.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "app/viewer/model/map_objects.h"
#include "app/viewer/panels/panels.h"
#include "app/viewer/widgets/widgets.h"

namespace sqslam::viewer {
namespace {

// The table of objects with its filter, and actions on the selected object.
class ObjectsPanel : public Panel {
 public:
  explicit ObjectsPanel(ViewerState& s) : Panel(Place::kSide, "Objects", s) {}

  void Draw() override {
    if (document_.Map() == nullptr) {
      ImGui::TextDisabled("No map is open.");
      return;
    }
    MakeRows();
    DrawFilter();
    const SnapshotObject* selected = document_.Object(selection_.selected);
    const float bar = selected != nullptr ? ImGui::GetFrameHeightWithSpacing() : 0.0F;
    DrawTable(std::max(ImGui::GetContentRegionAvail().y - bar, 3.0F * ImGui::GetFrameHeight()));
    if (selected != nullptr) {
      DrawActions(selected->id);
    }
  }

 private:
  // Makes the rows of the edited map, including hidden objects.
  void MakeRows() {
    const ShownFramePtr& recorded = document_.recorded;
    const ObjectEdits& edits = context_.editing.applied.edits;
    if (!recorded || !recorded->map || (recorded->map == map_ && edits_ == edits && sorted_by_ == order_)) {
      return;
    }
    map_ = recorded->map;
    edits_ = edits;
    sorted_by_ = order_;
    rows_ = ObjectRows(*Apply(edits, *map_, HiddenObjects::kKeep), edits);
    SortRows(rows_, order_.column, order_.ascending);
  }

  void DrawFilter() {
    const auto shown = std::ranges::count_if(rows_, [this](const auto& row) { return filter_.Shows(row); });
    const std::string count = shown == std::ssize(rows_) ? fmt::format("{}", rows_.size())
                                                         : fmt::format("{} of {}", shown, rows_.size());
    const float width = ImGui::CalcTextSize("00 of 00").x + ImGui::GetFontSize();
    ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x - width);
    if (ImGui::InputTextWithHint("##filter", "Filter: cup, seen > 50, e1 < 0.3", &text_)) {
      filter_ = RowFilter(text_);
    }
    Tip("Words of name, label or number; comparisons with observations, points, score, ax, ay, az, e1, e2, "
        "yaw, residual, agreement");
    ImGui::SameLine();
    Dim(count);
    if (!filter_.Problem().empty()) {
      ImGui::PushStyleColor(ImGuiCol_Text, PaletteOf(window_.theme).bad);
      ImGui::TextWrapped("%s", filter_.Problem().c_str());
      ImGui::PopStyleColor();
    }
  }

  // Returns the columns of the table; all others are only for filters.
  static std::vector<ColumnInfo> Columns() {
    std::vector<ColumnInfo> columns;
    for (const ColumnInfo& info : ObjectColumns()) {
      if (info.column != ObjectColumn::kId && info.column != ObjectColumn::kLabel &&
          info.column != ObjectColumn::kYaw) {
        columns.push_back(info);
      }
    }
    return columns;
  }

  static float WidthOf(const ColumnInfo& info) {  // ems
    return info.column == ObjectColumn::kName ? 8.4F : info.title.size() > 5 ? 3.9F : 3.0F;
  }

  // Shows as many columns as fit, those of the inspector last; a right click on the header shows others. Must
  // be called within a table.
  void FitColumns(float room) {
    using enum ObjectColumn;
    constexpr std::array kByNeed = {kName,  kObservations, kPoints, kE1,    kE2,      kAgreement,
                                    kSizeX, kSizeY,        kSizeZ,  kScore, kResidual};
    if (std::exchange(room_, room) == room) {
      return;
    }
    const float em = ImGui::GetFontSize();
    for (const ObjectColumn column : kByNeed) {
      const auto found = std::ranges::find(columns_, column, &ColumnInfo::column);
      room -= WidthOf(*found) * em + 2.0F * ImGui::GetStyle().CellPadding.x;
      ImGui::TableSetColumnEnabled(static_cast<int>(found - columns_.begin()), room >= 0.0F);
    }
  }

  void DrawTable(float height) {
    const ImGuiTableFlags flags = ImGuiTableFlags_ScrollX | ImGuiTableFlags_ScrollY | ImGuiTableFlags_RowBg |
                                  ImGuiTableFlags_Sortable | ImGuiTableFlags_Resizable |
                                  ImGuiTableFlags_Hideable | ImGuiTableFlags_NoSavedSettings;
    const float width = ImGui::GetContentRegionAvail().x;
    if (!ImGui::BeginTable("objects", static_cast<int>(columns_.size()), flags, ImVec2(0.0F, height))) {
      return;
    }
    const float em = ImGui::GetFontSize();
    FitColumns(width - ImGui::GetStyle().ScrollbarSize);
    ImGui::TableSetupScrollFreeze(1, 1);
    for (const ColumnInfo& info : columns_) {
      const bool name = info.column == ObjectColumn::kName;
      const bool counts = info.column == ObjectColumn::kObservations || info.column == ObjectColumn::kPoints;
      ImGui::TableSetupColumn(info.title.c_str(),
                              ImGuiTableColumnFlags_WidthFixed |
                                  (counts ? ImGuiTableColumnFlags_PreferSortDescending : 0) |
                                  (name ? ImGuiTableColumnFlags_NoHide : 0),
                              WidthOf(info) * em, static_cast<ImGuiID>(info.column));
    }
    TakeOrder();
    ImGui::TableNextRow(ImGuiTableRowFlags_Headers);
    for (const ColumnInfo& info : columns_) {
      ImGui::TableNextColumn();
      ImGui::TableHeader(info.title.c_str());
      Tip(info.help.c_str());
    }
    for (const ObjectRow& row : rows_) {
      if (filter_.Shows(row)) {
        DrawRow(row);
      }
    }
    ImGui::EndTable();
  }

  void TakeOrder() {
    ImGuiTableSortSpecs* specs = ImGui::TableGetSortSpecs();
    if (specs != nullptr && specs->SpecsDirty && specs->SpecsCount > 0) {
      order_ = {static_cast<ObjectColumn>(specs->Specs[0].ColumnUserID),
                specs->Specs[0].SortDirection == ImGuiSortDirection_Ascending};
      specs->SpecsDirty = false;
    }
  }

  void DrawRow(const ObjectRow& row) {
    const int id = row.object.id;
    ImGui::TableNextRow();
    ImGui::PushID(id);
    ImGui::PushStyleColor(ImGuiCol_Text,
                          ImGui::GetStyleColorVec4(row.hidden ? ImGuiCol_TextDisabled : ImGuiCol_Text));
    for (const ColumnInfo& info : columns_) {
      ImGui::TableNextColumn();
      if (info.column == ObjectColumn::kName) {
        DrawName(row);
        continue;
      }
      const std::string cell = CellText(row, info.column);
      const float room = ImGui::GetContentRegionAvail().x - ImGui::CalcTextSize(cell.c_str()).x;
      ImGui::SetCursorPosX(ImGui::GetCursorPosX() + std::max(0.0F, room - 0.3F * ImGui::GetFontSize()));
      ImGui::TextUnformatted(cell.c_str());
    }
    ImGui::PopStyleColor();
    ImGui::PopID();
  }

  void DrawName(const ObjectRow& row) {
    const int id = row.object.id;
    Swatch(document_.colors(row.object.label), row.hidden);
    const bool selected = selection_.selected == id;
    if (ImGui::Selectable(ObjectName(row.object).c_str(), selected,
                          ImGuiSelectableFlags_SpanAllColumns | ImGuiSelectableFlags_AllowDoubleClick)) {
      const bool twice = ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left);
      if (row.hidden) {
        context_.HideObject(id, false);
      } else if (twice) {
        window_.to_front = "Inspector";
      }
      selection_.selected = selected && !row.hidden && !twice ? std::nullopt : std::optional(id);
    }
    if (ImGui::IsItemHovered()) {
      selection_.pointed = id;
      if (row.hidden) {
        ImGui::SetTooltip("Hidden; a click shows it again");
      }
    }
  }

  void DrawActions(int id) {
    if (Button("Hide", "Leaves it out of pictures, not of files; a click on its row shows it again")) {
      context_.HideObject(id, true);
    }
    ImGui::SameLine();
    if (Button("Delete", "Takes it out of the edited map (Delete). The recording stays as it is")) {
      context_.DeleteObject(id);
    }
  }

  struct Order {
    ObjectColumn column = ObjectColumn::kName;
    bool ascending = true;
    bool operator==(const Order&) const = default;
  };

  const std::vector<ColumnInfo> columns_ = Columns();
  std::string text_;
  RowFilter filter_;
  Order order_, sorted_by_;
  MapSnapshotPtr map_;
  ObjectEdits edits_;
  std::vector<ObjectRow> rows_;
  float room_ = 0.0F;  // for which the columns were chosen, pixels
};

}  // namespace

PanelPtr MakeObjectsPanel(ViewerState& s) { return std::make_unique<ObjectsPanel>(s); }

}  // namespace sqslam::viewer
