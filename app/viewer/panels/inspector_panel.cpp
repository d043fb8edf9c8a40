#include <fmt/format.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "app/viewer/panels/panels.h"
#include "app/viewer/state/edit_actions.h"
#include "app/viewer/widgets/line_plot.h"
#include "app/viewer/widgets/widgets.h"
#include "slam/geometry/angles.h"

namespace sqslam::viewer {
namespace {

void DrawNumbers(const SnapshotObject& object) {
  if (!Section("Numbers")) {
    return;
  }
  const Superquadric& shape = object.superquadric.shape;
  const Eigen::Vector3d& at = object.superquadric.T_map_object.translation;
  const auto sigma = [&](int i) { return std::sqrt(std::max(0.0, object.fit.covariance(i, i))); };
  const bool sure = object.fit.covariance.trace() > 0.0;
  const auto with = [&](const std::string& text, double error, double factor = 1.0) {
    return sure ? fmt::format("{}  \u00b1 {:.2g}", text, factor * error) : text;
  };
  Row("centre", fmt::format("{:.3f}  {:.3f}  {:.3f}", at.x(), at.y(), at.z()));
  Row("half sizes",
      fmt::format("{:.3f}  {:.3f}  {:.3f}", shape.half_size.x(), shape.half_size.y(), shape.half_size.z()));
  Row("e1", with(fmt::format("{:.2f}", shape.e1), sigma(7)));
  Row("e2", with(fmt::format("{:.2f}", shape.e2), sigma(8)));
  Row("yaw",
      with(fmt::format("{:.1f}\u00b0", object.yaw * kDegreesPerRadian + 0.0), sigma(6), kDegreesPerRadian) +
          (sure ? "\u00b0" : ""));
  Row("seen", fmt::format("in {} frames, {} points", object.observations, object.points));
  Row("detector score", fmt::format("{:.2f}", object.score));
  Row("IoU with boxes", object.fit.box_agreement > 0.0 ? fmt::format("{:.2f}", object.fit.box_agreement)
                                                       : std::string("\u2013"));
  Row("residual",
      object.points > 0 ? fmt::format("{:.2g} map units rms", object.fit.point_rms) : std::string("\u2013"));
}

void DrawPoints(ViewerState& state) {
  if (!Section("Points in the scene")) {
    return;
  }
  constexpr std::array<const char*, 3> kNames = {"as they are", "residual", "anomaly"};
  constexpr std::array<const char*, 3> kTips = {
      "No marks on the object's points",
      "Distance to the surface: dark on it, light far off; crosses were taken away as outliers",
      "Score of the isolation forest: dark like the others, light unlike them; crosses were taken away"};
  for (int i = 0; i < 3; ++i) {
    if (i > 0) {
      ImGui::SameLine();
    }
    const auto at = static_cast<std::size_t>(i);
    bool on = static_cast<int>(state.editing.point_colors) == i;
    if (Toggle(kNames[at], &on, kTips[at])) {
      state.editing.point_colors = static_cast<PointColors>(i);
    }
  }
}

// A field that is applied with Enter or when it is left. True then.
bool Field(const char* name, std::string& text) {
  ImGui::AlignTextToFramePadding();
  ImGui::TextDisabled("%s", name);
  ImGui::SameLine(4.0F * ImGui::GetFontSize());
  ImGui::SetNextItemWidth(-1.0F);
  ImGui::InputText((std::string("##") + name).c_str(), &text, ImGuiInputTextFlags_AutoSelectAll);
  return ImGui::IsItemDeactivatedAfterEdit();
}

// The selected object: what can be done to it, its numbers, how it came about, its points.
class InspectorPanel : public Panel {
 public:
  Place Where() const override { return Place::kSide; }
  std::string Title() const override { return "Inspector"; }

  void Draw(ViewerState& state) override {
    const SnapshotObject* object = state.Object(state.selected);
    if (object == nullptr) {
      ImGui::TextDisabled(state.selected ? "The object is not in the map at this frame."
                                         : "Select an object in the map, the image or the table.");
      return;
    }
    const SnapshotObject shown = *object;  // buttons may change the map
    ImGui::BeginChild("inspector");
    ImGui::PushID(shown.id);
    DrawEditing(state, shown);
    DrawNumbers(shown);
    DrawHistory(state, shown);
    DrawPoints(state);
    ImGui::PopID();
    ImGui::EndChild();
  }

 private:
  void DrawEditing(ViewerState& state, const SnapshotObject& object);
  void DrawMerging(ViewerState& state, const SnapshotObject& object);
  void DrawHistory(ViewerState& state, const SnapshotObject& object);

  int id_ = -1;  // of whom the fields hold name and label
  std::string name_, label_;
  bool by_frame_ = false;  // histories against frames instead of observations
};

void InspectorPanel::DrawEditing(ViewerState& state, const SnapshotObject& object) {
  ImGui::Dummy(ImVec2(0.0F, 0.15F * ImGui::GetFontSize()));
  Swatch(state.colors(object.label));
  Bold(NameForPeople(object).c_str());
  if (id_ != object.id || !ImGui::IsAnyItemActive()) {  // what undo changed comes into the fields
    id_ = object.id;
    name_ = object.name;
    label_ = object.label;
  }
  if (Field("name", name_)) {
    RenameObject(state, object.id, name_);
  }
  if (Field("label", label_)) {
    RelabelObject(state, object.id, label_);
  }
  const bool hidden = state.editing.document.Current().edits.Of(object.id).hidden;
  if (ImGui::Button(hidden ? "Show" : "Hide")) {
    HideObject(state, object.id, !hidden);
  }
  Tip("Hidden objects are left out of pictures, not of files");
  ImGui::SameLine();
  if (ImGui::Button("Delete")) {
    DeleteObject(state, object.id);
  }
  Tip("Takes it out of the edited map (Delete). The recording stays as it is");
  ImGui::SameLine();
  DrawMerging(state, object);
}

void InspectorPanel::DrawMerging(ViewerState& state, const SnapshotObject& object) {
  ImGui::SetNextItemWidth(-1.0F);
  if (ImGui::BeginCombo("##merge", "Merge with ...", ImGuiComboFlags_HeightLarge)) {
    for (const SnapshotObject& other : state.Map()->objects) {
      if (other.id == object.id) {
        continue;
      }
      ImGui::PushID(other.id);
      Swatch(state.colors(other.label));
      if (ImGui::Selectable(NameForPeople(other).c_str())) {
        MergeObjects(state, object.id, other.id);
      }
      if (ImGui::IsItemHovered()) {
        state.pointed = other.id;
      }
      ImGui::PopID();
    }
    ImGui::EndCombo();
  }
  Tip("The chosen object becomes a part of this one, which keeps its number and its solid");
  for (const int part : state.editing.document.Current().edits.PartsOf(object.id)) {
    ImGui::PushID(part);
    ImGui::AlignTextToFramePadding();
    ImGui::TextDisabled("with object %d", part);
    ImGui::SameLine();
    if (ImGui::SmallButton("separate")) {
      SeparateObject(state, part);
    }
    ImGui::PopID();
  }
}

void InspectorPanel::DrawHistory(ViewerState& state, const SnapshotObject& object) {
  const Editing& editing = state.editing;
  if (state.document.kind != Document::Kind::kRecording || !Section("History")) {
    return;
  }
  if (!editing.history) {
    ImGui::ProgressBar(static_cast<float>(editing.history_progress), ImVec2(-1.0F, 0.0F), "reading");
    return;
  }
  const auto found = editing.history->objects.All().find(object.id);
  if (found == editing.history->objects.All().end()) {
    ImGui::TextDisabled("Not in the recording.");
    return;
  }
  const std::vector<ObjectSample>& samples = found->second.samples;
  ImGui::AlignTextToFramePadding();
  ImGui::TextDisabled("against");
  ImGui::SameLine();
  bool by_observations = !by_frame_;
  if (Toggle("observations", &by_observations, "Frames in which the object was seen")) {
    by_frame_ = false;
  }
  ImGui::SameLine();
  bool by_frame = by_frame_;
  if (Toggle("frames", &by_frame, "Frames of the sequence")) {
    by_frame_ = true;
  }
  const Palette& palette = PaletteOf(state.theme);
  Plot sizes{"half sizes, map units",
             {},
             {{"ax", palette.plot_a, {}}, {"ay", palette.plot_b, {}}, {"az", palette.plot_c, {}}},
             by_frame_ ? "frame" : "observations",
             "{:.2g}",
             {},
             {}};
  Plot shapes{"exponents",        {},       {{"e1", palette.plot_a, {}}, {"e2", palette.plot_b, {}}},
              sizes.x_name,       "{:.1f}", {},
              std::pair(0.0, 2.0)};
  Plot yaw{"yaw, degrees", {}, {{"yaw", palette.plot_a, {}}}, sizes.x_name, "{:.0f}", {}, {}};
  for (const ObjectSample& sample : samples) {
    sizes.x.push_back(by_frame_ ? static_cast<double>(sample.frame_index) : sample.observations);
    for (int axis = 0; axis < 3; ++axis) {
      sizes.lines[static_cast<std::size_t>(axis)].values.push_back(sample.half_size[axis]);
    }
    shapes.lines[0].values.push_back(sample.e1);
    shapes.lines[1].values.push_back(sample.e2);
    yaw.lines[0].values.push_back(sample.yaw * kDegreesPerRadian);
    if (state.shown && sample.frame_index <= state.shown->frame_index) {
      sizes.now = sizes.x.back();
    }
  }
  shapes.x = yaw.x = sizes.x;
  shapes.now = yaw.now = sizes.now;
  const float height = 3.4F * ImGui::GetFontSize();
  std::optional<std::size_t> clicked;
  for (const auto& [id, plot] : {std::pair("sizes", &sizes), {"shapes", &shapes}, {"yaw", &yaw}}) {
    const std::optional<std::size_t> index = DrawPlot(state, id, *plot, height);
    clicked = index ? index : clicked;
  }
  if (clicked) {
    const Timeline& timeline = state.document.timeline;
    const int moment = timeline.OfSnapshot(samples[*clicked].snapshot);
    if (moment >= 0) {
      state.playback.playing = false;
      state.playback.time = timeline.moments[static_cast<std::size_t>(moment)].timestamp;
    }
  }
}

}  // namespace

PanelPtr MakeInspectorPanel() { return std::make_unique<InspectorPanel>(); }

}  // namespace sqslam::viewer
