#include <fmt/format.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <array>
#include <string>

#include "app/viewer/panels/panels.h"
#include "app/viewer/state/annotation_tool.h"
#include "app/viewer/widgets/widgets.h"
#include "slam/geometry/angles.h"

namespace sqslam::viewer {
namespace {

// What people call it: its name, or its label without underscores, with its number.
std::string SolidName(const AnnotatedSolid& solid) {
  std::string name = solid.name.empty() ? solid.label : solid.name;
  if (solid.name.empty()) {
    std::replace(name.begin(), name.end(), '_', ' ');
  }
  return fmt::format("{} {}", name, solid.id);
}

constexpr std::array<SolidKind, 4> kKinds = {SolidKind::kCuboid, SolidKind::kCylinder, SolidKind::kEllipsoid,
                                             SolidKind::kSuperquadric};

// Draws a ground truth over the map: solids by hand or fitted to points, checked against the images.
class AnnotationPanel : public Panel {
 public:
  Place Where() const override { return Place::kSide; }
  std::string Title() const override { return "Annotate"; }

  void Draw(ViewerState& state) override {
    if (!state.document.last) {
      ImGui::TextDisabled("No map is open.");
      return;
    }
    PrepareAnnotation(state);
    state.editing.annotation.drawn = true;
    ImGui::BeginChild("annotation");
    DrawAdding(state);
    DrawList(state);
    DrawSolid(state);
    DrawFiles(state);
    ImGui::EndChild();
  }

 private:
  static void DrawAdding(ViewerState& state) {
    AnnotationTool& tool = state.editing.annotation;
    Heading("New solid");
    ImGui::AlignTextToFramePadding();
    ImGui::TextDisabled("label");
    ImGui::SameLine(4.0F * ImGui::GetFontSize());
    ImGui::SetNextItemWidth(-1.0F);
    ImGui::InputText("##label", &tool.label);
    const float spacing = ImGui::GetStyle().ItemSpacing.x;
    const float half = 0.5F * (ImGui::GetContentRegionAvail().x - spacing);
    for (std::size_t i = 0; i < kKinds.size(); ++i) {
      if (i % 2 != 0) {
        ImGui::SameLine();
      }
      if (ImGui::Button(std::string(KindName(kKinds[i])).c_str(), ImVec2(half, 0.0F))) {
        AddSolid(state, kKinds[i]);
      }
      Tip(tool.chosen.empty() ? "Puts one on the ground in the middle of the view"
                              : "Fits one to the points that are chosen");
    }
    const SnapshotObject* object = state.Object(state.selected);
    if (object != nullptr) {
      if (ImGui::Button(("From " + ObjectName(*object)).c_str(), ImVec2(-1.0F, 0.0F))) {
        AddSolidOf(state, *object);
      }
      Tip("A solid in place of the object of the map that is selected");
    }
    bool objects = state.view.style.objects.show;
    if (ImGui::Checkbox("objects of the map", &objects)) {
      state.view.style.objects.show = objects;
      ++state.view.style_version;
    }
    Tip("They may hide the points; a layer of the view");
    Toggle("Lasso", &tool.lasso,
           "A drag in the scene chooses the points inside; Shift adds, Ctrl takes away");
    ImGui::SameLine();
    ImGui::AlignTextToFramePadding();
    ImGui::TextDisabled("%zu points chosen", tool.chosen.size());
    if (!tool.chosen.empty()) {
      ImGui::SameLine();
      if (ImGui::SmallButton("none")) {
        tool.chosen.clear();
      }
    }
  }

  static void DrawList(ViewerState& state) {
    AnnotationTool& tool = state.editing.annotation;
    const Annotation& annotation = state.editing.document.Current().annotation;
    Heading("Solids");
    if (annotation.solids.empty()) {
      ImGui::TextDisabled("None yet.");
      return;
    }
    const float line = ImGui::GetTextLineHeightWithSpacing();
    const float rows = std::clamp(static_cast<float>(annotation.solids.size()), 1.0F, 6.0F);
    ImGui::BeginChild("solids", ImVec2(0.0F, (rows + 0.3F) * line));
    for (const AnnotatedSolid& solid : annotation.solids) {
      ImGui::PushID(solid.id);
      Swatch(state.colors(solid.label));
      const std::string text = SolidName(solid);
      const bool selected = tool.selected == solid.id;
      if (ImGui::Selectable(text.c_str(), selected)) {
        tool.selected = selected ? std::nullopt : std::optional(solid.id);
      }
      const std::string kind(KindName(solid.solid.kind));
      ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize(kind.c_str()).x -
                      0.8F * ImGui::GetFontSize());
      ImGui::TextDisabled("%s", kind.c_str());
      ImGui::PopID();
    }
    ImGui::EndChild();
  }

  // Three numbers in a row; true while they change. What is not allowed is not taken.
  static bool Drag3(const char* name, Eigen::Vector3d& values, float speed, float low, float high) {
    Eigen::Vector3f v = values.cast<float>();
    ImGui::SetNextItemWidth(-7.0F * ImGui::GetFontSize());
    const bool changed = ImGui::DragFloat3(name, v.data(), speed, low, high, "%.3f",
                                           low < high ? ImGuiSliderFlags_AlwaysClamp : 0);
    if (changed) {
      values = v.cast<double>();
    }
    return changed;
  }

  static bool Drag(const char* name, double& value, float speed, float low, float high, const char* format) {
    auto v = static_cast<float>(value);
    ImGui::SetNextItemWidth(-7.0F * ImGui::GetFontSize());
    const bool changed =
        ImGui::DragFloat(name, &v, speed, low, high, format, low < high ? ImGuiSliderFlags_AlwaysClamp : 0);
    if (changed) {
      value = static_cast<double>(v);
    }
    return changed;
  }

  void DrawSolid(ViewerState& state) {
    const AnnotatedSolid* selected = SelectedSolid(state);
    if (selected == nullptr) {
      return;
    }
    AnnotatedSolid solid = *selected;
    ImGui::PushID(solid.id);
    Heading(SolidName(solid).c_str());
    bool changed = false;
    bool finished = false;
    const auto field = [&](bool moved) {
      changed |= moved;
      finished |= ImGui::IsItemDeactivatedAfterEdit();
    };
    ImGui::SetNextItemWidth(-7.0F * ImGui::GetFontSize());
    field(ImGui::InputText("label", &solid.label));
    ImGui::SetNextItemWidth(-7.0F * ImGui::GetFontSize());
    if (ImGui::BeginCombo("shape", std::string(KindName(solid.solid.kind)).c_str())) {
      for (const SolidKind kind : kKinds) {
        if (ImGui::Selectable(std::string(KindName(kind)).c_str(), kind == solid.solid.kind)) {
          SetKind(solid.solid, kind);
          changed = finished = true;
        }
      }
      ImGui::EndCombo();
    }
    const auto speed = static_cast<float>(0.002 * state.focus.radius);
    field(Drag3("centre", solid.solid.T_map_object.translation, speed, 0.0F, 0.0F));
    field(Drag3("half sizes", solid.solid.half_size, 0.5F * speed, 1e-4F, 1e6F));
    double yaw = YawOf(solid.solid) * kDegreesPerRadian;
    if (Drag("yaw", yaw, 0.3F, 0.0F, 0.0F, "%.1f\u00b0")) {
      SetYaw(solid.solid, yaw / kDegreesPerRadian);
      changed = true;
    }
    finished |= ImGui::IsItemDeactivatedAfterEdit();
    if (solid.solid.kind == SolidKind::kSuperquadric) {
      field(Drag("e1", solid.solid.e1, 0.005F, 0.1F, 1.9F, "%.2f"));
      field(Drag("e2", solid.solid.e2, 0.005F, 0.1F, 1.9F, "%.2f"));
    }
    if (changed) {
      ChangeSolid(state, solid);
    }
    if (finished) {
      state.editing.document.EndGroup();
    }
    DrawSolidButtons(state);
    ImGui::PopID();
  }

  static void DrawSolidButtons(ViewerState& state) {
    AnnotationTool& tool = state.editing.annotation;
    if (ImGui::Button("Fit to points")) {
      FitSolid(state);
    }
    Tip("Moves, turns and resizes it to suit the chosen points, or those in it and a little around it");
    ImGui::SameLine();
    ImGui::BeginDisabled(!tool.ground.has_value());
    if (ImGui::Button("To the ground")) {
      StandOnGround(state);
    }
    ImGui::EndDisabled();
    Tip("Moves it up or down to stand on the plane of the map");
    ImGui::SameLine();
    if (ImGui::Button("Remove")) {
      RemoveSolid(state);
    }
    ImGui::Checkbox("fits reach the ground", &tool.standing);
    Tip("The lower part of things is seldom seen: fits end at the ground, and its points are left out");
    ImGui::SameLine(0.0F, 1.4F * ImGui::GetFontSize());
    ImGui::Checkbox("round", &tool.round);
    Tip("Cylinders get a circular cross-section");
  }

  static void DrawFiles(ViewerState& state) {
    AnnotationTool& tool = state.editing.annotation;
    if (!Section("File and points")) {
      return;
    }
    ImGui::SetNextItemWidth(-1.0F);
    ImGui::InputText("##file", &tool.file);
    Tip("objects_gt.json to read or write");
    if (ImGui::Button("Open")) {
      OpenAnnotationFile(state);
    }
    ImGui::SameLine();
    if (ImGui::Button(state.editing.document.AnnotationModified() ? "Save *" : "Save")) {
      SaveAnnotationFile(state);
    }
    ImGui::SameLine();
    bool in_world = tool.in_world;
    if (ImGui::Checkbox("in the world's frame", &in_world)) {
      tool.in_world = in_world && AlignWithWorld(state);
    }
    Tip("The file is in metres, in the frame of the sequence's true camera poses; otherwise in the frame and "
        "units of the map");
    ImGui::SetNextItemWidth(-7.5F * ImGui::GetFontSize());
    ImGui::InputTextWithHint("##cloud", "points of the map", &tool.cloud_file);
    Tip("A dense cloud to fit to (.ply, or text with x y z), in the same frame as the file");
    ImGui::SameLine();
    if (ImGui::Button("Load points", ImVec2(-1.0F, 0.0F))) {
      OpenCloudFile(state);
    }
  }
};

}  // namespace

PanelPtr MakeAnnotationPanel() { return std::make_unique<AnnotationPanel>(); }

}  // namespace sqslam::viewer
