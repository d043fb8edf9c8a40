#include <fmt/format.h>
#include <fmt/ranges.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "app/viewer/panels/panels.h"
#include "app/viewer/widgets/widgets.h"
#include "slam/geometry/angles.h"
#include "slam/util/to_vector.h"

namespace sqslam::viewer {
namespace {

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
  if (const auto colors =
          OneOf({{"as they are", "No marks on the object's points"},
                 {"residual",
                  "Distance to the surface: dark on it, light far off; crosses were taken away as outliers"},
                 {"anomaly",
                  "Score of the isolation forest: dark like the others, light unlike them; crosses were "
                  "taken away"}},
                static_cast<int>(editing.point_colors))) {
    editing.point_colors = static_cast<PointColors>(*colors);
  }
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
    Swatch(document_.colors(object.label));
    Bold(ObjectName(object).c_str());
    if (id_ != object.id || !ImGui::IsAnyItemActive()) {  // takes over what undo changed
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
    ImGui::SetNextItemWidth(-1.0F);
    if (ImGui::BeginCombo("##merge", "Merge with ...", ImGuiComboFlags_HeightLarge)) {
      for (const SnapshotObject& other : document_.Map()->objects) {
        if (other.id == object.id) {
          continue;
        }
        ImGui::PushID(other.id);
        Swatch(document_.colors(other.label));
        if (ImGui::Selectable(ObjectName(other).c_str())) {
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
      if (ImGui::SmallButton("separate")) {
        context_.SeparateObject(part);
      }
      ImGui::PopID();
    }
  }

  void DrawHistory(const SnapshotObject& object) {
    if (document_.kind != Document::Kind::kRecording || !Section("History")) {
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
    if (const auto chosen = OneOf(
            {{"observations", "Frames in which the object was seen"}, {"frames", "Frames of the sequence"}},
            by_frame_ ? 1 : 0)) {
      by_frame_ = *chosen == 1;
    }
    DrawPlots(found->second);
  }

  void DrawPlots(const std::vector<ObjectSample>& samples) {
    const Palette& palette = PaletteOf(window_.theme);
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

PanelPtr MakeInspectorPanel(ViewerState& s) { return std::make_unique<InspectorPanel>(s); }

}  // namespace sqslam::viewer
