#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "app/viewer/model/map_objects.h"
#include "app/viewer/model/object_search.h"
#include "app/viewer/panels/panels.h"
#include "app/viewer/widgets/widgets.h"
#include "slam/geometry/angles.h"
#include "slam/util/to_vector.h"

namespace sqslam::viewer {
namespace {

// The table of objects with its search, and actions on the selected object.
class ObjectsPanel : public Panel {
 public:
  explicit ObjectsPanel(ViewerState& s) : Panel(Place::kSide, "Objects", s) {}

  void Draw() override {
    if (document_.Map() == nullptr) {
      ImGui::TextDisabled("No map is open.");
      return;
    }
    MakeRows();
    DrawSearch();
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

  void DrawSearch() {
    const auto shown = std::ranges::count_if(rows_, [this](const auto& row) { return search_.Shows(row); });
    const std::string count = shown == std::ssize(rows_) ? fmt::format("{}", rows_.size())
                                                         : fmt::format("{} of {}", shown, rows_.size());
    const float width = ImGui::CalcTextSize("00 of 00").x + ImGui::GetFontSize();
    ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x - width);
    const bool typed = ImGui::InputTextWithHint("##search", "cup, seen > 50, cups on the table", &text_);
    ReportItem("search");
    // During a run the map changes all the time: its relations are found again when the text changes.
    if (typed || !document_.run.active) {
      search_.Update(text_, rows_, document_.last, document_.file.parent_path());
    }
    selection_.answers = search_.Answers();
    if (text_.empty()) {  // the tip would cover the answer
      Tip("Words of name, label or number; comparisons with observations, points, score, ax, ay, az, e1, e2, "
          "yaw, residual, agreement; or a question, such as: largest box next to the sink");
    }
    ImGui::SameLine();
    Dim(count);
    if (!search_.Message().empty()) {
      const Palette& palette = PaletteOf(window_.settings.theme);
      ImGui::PushStyleColor(ImGuiCol_Text, search_.Failed() ? palette.bad : palette.text);
      ImGui::TextWrapped("%s", search_.Message().c_str());
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

  // Shows as many columns as fit, the most important first; a right click on the header shows others. Must
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
      ReportItem(info.title);
      Tip(info.help.c_str());
    }
    for (const ObjectRow& row : rows_) {
      if (search_.Shows(row)) {
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
    Swatch(view_.colors(row.object.label), row.hidden);
    const bool selected = selection_.selected == id;
    if (Selectable(ObjectName(row.object), selected,
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
  ObjectSearch search_;
  Order order_, sorted_by_;
  MapSnapshotPtr map_;
  ObjectEdits edits_;
  std::vector<ObjectRow> rows_;
  float room_ = 0.0F;  // for which the columns were chosen, pixels
};

void DrawNumbers(const SnapshotObject& object, const char* unit) {
  if (!Section("Numbers")) {
    return;
  }
  const Superquadric& shape = object.superquadric.shape;
  const auto sigma = [&](int i) { return std::sqrt(std::max(0.0, object.fit.covariance(i, i))); };
  const bool sure = object.fit.covariance.trace() > 0.0;
  const auto with = [&](const std::string& text, double error, double factor = 1.0) {
    return sure ? fmt::format("{}  \u00b1 {:.2g}", text, factor * error) : text;
  };
  Row("centre", fmt::format("{:.3f}", fmt::join(object.superquadric.T_map_object.translation, "  ")));
  Row("half sizes", fmt::format("{:.3f}", fmt::join(shape.half_size, "  ")));
  Row("e1", with(fmt::format("{:.2f}", shape.e1), sigma(7)));
  Row("e2", with(fmt::format("{:.2f}", shape.e2), sigma(8)));
  Row("yaw",
      with(fmt::format("{:.1f}\u00b0", object.yaw * kDegreesPerRadian + 0.0), sigma(6), kDegreesPerRadian) +
          (sure ? "\u00b0" : ""));
  Row("seen", fmt::format("in {} frames, {} points", object.observations, object.points));
  Row("detector score", fmt::format("{:.2f}", object.score));
  const std::string unknown = "\u2013";
  Row("IoU with boxes",
      object.fit.box_agreement > 0.0 ? fmt::format("{:.2f}", object.fit.box_agreement) : unknown);
  Row("residual", object.points > 0 ? fmt::format("{:.2g} {} rms", object.fit.point_rms, unit) : unknown);
}

void DrawPoints(Editing& editing) {
  if (!Section("Points in the scene")) {
    return;
  }
  OneOf({{"as they are", "No marks on the object's points"},
         {"residual", "Distance to the surface: dark on it, light far off; crosses are outliers"},
         {"anomaly", "Score of the isolation forest: dark inliers to light anomalies; crosses are outliers"}},
        editing.point_colors);
}

// The selected object: its actions, numbers, history and points.
class InspectorPanel : public Panel {
 public:
  explicit InspectorPanel(ViewerState& s) : Panel(Place::kSide, "Inspector", s) {}

  void Draw() override {
    const SnapshotObject* object = document_.Object(context_.selection.selected);
    if (object == nullptr) {
      ImGui::TextDisabled(context_.selection.selected
                              ? "The object is not in the map at this frame."
                              : "Select an object in the map, the image or the table.");
      return;
    }
    ImGui::BeginChild("inspector");
    ImGui::PushID(object->id);
    DrawEditing(*object);
    DrawNumbers(*object, UnitOf(*document_.Map()));
    DrawHistory(*object);
    DrawPoints(context_.editing);
    ImGui::PopID();
    ImGui::EndChild();
  }

 private:
  void DrawEditing(const SnapshotObject& object) {
    ImGui::Dummy(ImVec2(0.0F, 0.15F * ImGui::GetFontSize()));
    Swatch(view_.colors(object.label));
    Bold(ObjectName(object).c_str());
    if (id_ != object.id || !ImGui::IsAnyItemActive()) {  // undo may have changed them
      id_ = object.id;
      name_ = object.name;
      label_ = object.label;
    }
    if (Field("name", name_, ImGuiInputTextFlags_AutoSelectAll)) {
      context_.RenameObject(object.id, name_);
    }
    if (Field("label", label_, ImGuiInputTextFlags_AutoSelectAll)) {
      context_.RelabelObject(object.id, label_);
    }
    const bool hidden = context_.editing.Edits().Of(object.id).hidden;
    if (Button(hidden ? "Show" : "Hide", "Hidden objects are left out of pictures, not of files")) {
      context_.HideObject(object.id, !hidden);
    }
    ImGui::SameLine();
    if (Button("Delete", "Takes it out of the edited map (Delete). The recording stays as it is")) {
      context_.DeleteObject(object.id);
    }
    ImGui::SameLine();
    DrawMerging(object);
  }

  void DrawMerging(const SnapshotObject& object) {
    if (BeginCombo("##merge", "Merge with ...", -0.1F)) {
      for (const SnapshotObject& other : document_.Map()->objects) {
        if (other.id == object.id) {
          continue;
        }
        ImGui::PushID(other.id);
        Swatch(view_.colors(other.label));
        if (Selectable(ObjectName(other))) {
          context_.MergeObjects(object.id, other.id);
        }
        if (ImGui::IsItemHovered()) {
          context_.selection.pointed = other.id;
        }
        ImGui::PopID();
      }
      ImGui::EndCombo();
    }
    Tip("The chosen object becomes a part of this one, which keeps its number and its solid");
    for (const int part : context_.editing.Edits().PartsOf(object.id)) {
      ImGui::PushID(part);
      Label(fmt::format("with object {}", part));
      if (SmallButton("separate")) {
        context_.SeparateObject(part);
      }
      ImGui::PopID();
    }
  }

  void DrawHistory(const SnapshotObject& object) {
    if (document_.run.active || !Section("History")) {
      return;
    }
    if (!document_.histories) {
      ImGui::ProgressBar(static_cast<float>(document_.progress), ImVec2(-1.0F, 0.0F), "reading");
      return;
    }
    const auto found = document_.histories->find(object.id);
    if (found == document_.histories->end()) {
      ImGui::TextDisabled("Not in the recording.");
      return;
    }
    Label("against");
    OneOf({{"observations", "Frames in which the object was seen"}, {"frames", "Frames of the sequence"}},
          by_frame_);
    DrawPlots(found->second);
  }

  void DrawPlots(const std::vector<ObjectSample>& samples) {
    const Palette& palette = PaletteOf(window_.settings.theme);
    const auto x_of = [this](const ObjectSample& sample) {
      return by_frame_ ? static_cast<double>(sample.frame_index) : sample.observations;
    };
    std::optional<double> now;
    for (const ObjectSample& sample : samples) {
      if (document_.shown && sample.frame_index <= document_.shown->frame_index) {
        now = x_of(sample);
      }
    }
    const auto line = [&](const char* name, ImU32 color, auto value) {
      return PlotLine{name, color, ToVector(samples, value)};
    };
    const auto half = [](int axis) { return [axis](const ObjectSample& s) { return s.half_size[axis]; }; };
    const auto degrees = [](const ObjectSample& s) { return s.yaw * kDegreesPerRadian; };
    const std::vector<double> x = ToVector(samples, x_of);
    const std::string x_name = by_frame_ ? "frame" : "observations";
    std::optional<std::size_t> clicked;
    const auto draw = [&](const char* name, std::vector<PlotLine> lines, const char* format,
                          std::optional<std::pair<double, double>> range = {}) {
      const Plot plot{name, x, std::move(lines), x_name, format, now, range};
      const auto index = DrawPlot(palette, name, plot, 3.4F * ImGui::GetFontSize());
      clicked = index ? index : clicked;
    };
    draw(document_.Map()->metric ? "half sizes, m" : "half sizes, map units",
         {line("ax", palette.plot_a, half(0)), line("ay", palette.plot_b, half(1)),
          line("az", palette.plot_c, half(2))},
         "{:.2g}");
    draw("exponents",
         {line("e1", palette.plot_a, &ObjectSample::e1), line("e2", palette.plot_b, &ObjectSample::e2)},
         "{:.1f}", std::pair(0.0, 2.0));
    draw("yaw, degrees", {line("yaw", palette.plot_a, degrees)}, "{:.0f}");
    const Timeline& timeline = document_.timeline;
    const int moment = clicked ? timeline.OfSnapshot(samples[*clicked].snapshot) : -1;
    if (moment >= 0) {
      playback_.JumpTo(timeline.moments[static_cast<std::size_t>(moment)].timestamp);
    }
  }

  int id_ = -1;  // the object whose name and label the fields hold
  std::string name_, label_;
  bool by_frame_ = false;  // histories over frames instead of observations
};

}  // namespace

PanelPtr MakeObjectsPanel(ViewerState& s) { return std::make_unique<ObjectsPanel>(s); }
PanelPtr MakeInspectorPanel(ViewerState& s) { return std::make_unique<InspectorPanel>(s); }

}  // namespace sqslam::viewer
