#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "app/viewer/panels/panels.h"
#include "app/viewer/state/editing.h"
#include "app/viewer/widgets/widgets.h"
#include "slam/geometry/angles.h"

namespace sqslam::viewer {
namespace {

// Returns "potted plant 3", or its own name with its number.
std::string SolidName(const AnnotatedSolid& solid) {
  return solid.name.empty() ? NumberedLabel(solid.label, solid.id)
                            : fmt::format("{} {}", solid.name, solid.id);
}

// Annotates a ground truth on the map: solids placed by hand or fitted to points, checked in the images.
class AnnotationPanel : public Panel {
 public:
  explicit AnnotationPanel(ViewerState& s) : Panel(Place::kSide, "Annotate", s) {}

  void Draw() override {
    if (!context_.document.last) {
      ImGui::TextDisabled("No map is open.");
      return;
    }
    context_.PrepareAnnotation();
    tool_.drawn = true;
    ImGui::BeginChild("annotation");
    DrawAdding();
    DrawList();
    DrawSolid();
    DrawFiles();
    ImGui::EndChild();
  }

 private:
  void DrawAdding() {
    Heading("New solid");
    Field("label", tool_.label);
    const float spacing = ImGui::GetStyle().ItemSpacing.x;
    const float half = 0.5F * (ImGui::GetContentRegionAvail().x - spacing);
    for (std::size_t i = 0; i < kSolidKinds.size(); ++i) {
      if (i % 2 != 0) {
        ImGui::SameLine();
      }
      if (Button(NameOf(kSolidKinds[i]),
                 tool_.chosen.empty() ? "Puts one on the ground in the middle of the view"
                                      : "Fits one to the points that are chosen",
                 ImVec2(half, 0.0F))) {
        context_.AddSolid(kSolidKinds[i]);
      }
    }
    const SnapshotObject* object = context_.document.Object(context_.selection.selected);
    if (object != nullptr &&
        Button(("From " + ObjectName(*object)).c_str(),
               "A solid in place of the object of the map that is selected", ImVec2(-1.0F, 0.0F))) {
      context_.AddSolidOf(*object);
    }
    Checkbox("objects of the map", style_.objects.show, "They may hide the points; a layer of the view");
    Toggle("Lasso", tool_.lasso,
           "A drag in the scene chooses the points inside; Shift adds, Ctrl takes away");
    ImGui::SameLine();
    ImGui::AlignTextToFramePadding();
    ImGui::TextDisabled("%zu points chosen", tool_.chosen.size());
    if (!tool_.chosen.empty()) {
      ImGui::SameLine();
      if (SmallButton("none")) {
        tool_.chosen.clear();
      }
    }
  }

  void DrawList() {
    const Annotation& annotation = editing_.Solids();
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
      Swatch(context_.view.colors(solid.label));
      const std::string text = SolidName(solid);
      const bool selected = tool_.selected == solid.id;
      if (Selectable(text, selected)) {
        tool_.selected = selected ? std::nullopt : std::optional(solid.id);
      }
      const std::string kind = NameOf(solid.solid.kind);
      ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize(kind.c_str()).x -
                      0.8F * ImGui::GetFontSize());
      Dim(kind);
      ImGui::PopID();
    }
    ImGui::EndChild();
  }

  void DrawSolid() {
    const AnnotatedSolid* selected = context_.SelectedSolid();
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
    std::string kind = NameOf(solid.solid.kind);
    if (Choice("shape", kind, AllNames<SolidKind>(), -7.0F)) {
      SetKind(solid.solid, *FromName<SolidKind>(kind));
      changed = finished = true;
    }
    const auto speed = static_cast<float>(0.002 * context_.view.focus.radius);
    field(Drag("centre", {solid.solid.T_map_object.translation.data(), 3}, speed, 0.0, 0.0, "%.3f"));
    field(Drag("half sizes", {solid.solid.half_size.data(), 3}, 0.5F * speed, 1e-4, 1e6, "%.3f"));
    double yaw = YawOf(solid.solid) * kDegreesPerRadian;
    if (Drag("yaw", {&yaw, 1}, 0.3F, 0.0, 0.0, "%.1f\u00b0")) {
      SetYaw(solid.solid, yaw / kDegreesPerRadian);
      changed = true;
    }
    finished |= ImGui::IsItemDeactivatedAfterEdit();
    if (solid.solid.kind == SolidKind::kSuperquadric) {
      field(Drag("e1", {&solid.solid.e1, 1}, 0.005F, 0.1, 1.9, "%.2f"));
      field(Drag("e2", {&solid.solid.e2, 1}, 0.005F, 0.1, 1.9, "%.2f"));
    }
    if (changed) {
      context_.ChangeSolid(solid);
    }
    if (finished) {
      editing_.document.EndGroup();
    }
    DrawSolidButtons();
    ImGui::PopID();
  }

  void DrawSolidButtons() {
    if (Button(
            "Fit to points",
            "Moves, turns and resizes it to suit the chosen points, or those in it and a little around it")) {
      context_.FitSolid();
    }
    ImGui::SameLine();
    ImGui::BeginDisabled(!tool_.ground.has_value());
    if (Button("To the ground", "Moves it up or down to stand on the plane of the map")) {
      context_.StandOnGround();
    }
    ImGui::EndDisabled();
    ImGui::SameLine();
    if (Button("Remove")) {
      context_.RemoveSolid();
    }
    Checkbox("fits reach the ground", tool_.standing,
             "Fits end at the ground, without its points: cameras seldom see the lower part of an object");
    ImGui::SameLine(0.0F, 1.4F * ImGui::GetFontSize());
    Checkbox("round", tool_.round, "Cylinders get a circular cross-section");
  }

  void DrawFiles() {
    if (!Section("File and points")) {
      return;
    }
    ImGui::SetNextItemWidth(-1.0F);
    ImGui::InputText("##file", &tool_.file);
    Tip("objects_gt.json to read or write");
    if (Button("Open")) {
      context_.OpenAnnotationFile();
    }
    ImGui::SameLine();
    if (Button(editing_.document.AnnotationModified() ? "Save *" : "Save")) {
      context_.SaveAnnotationFile();
    }
    ImGui::SameLine();
    bool in_world = tool_.in_world;
    if (Checkbox("in the world's frame", in_world,
                 "The file is in metres, in the frame of the sequence's true camera poses; otherwise in the "
                 "frame and units of the map")) {
      tool_.in_world = in_world && context_.AlignWithWorld();
    }
    ImGui::SetNextItemWidth(-7.5F * ImGui::GetFontSize());
    ImGui::InputTextWithHint("##cloud", "points of the map", &tool_.cloud_file);
    Tip("A dense cloud to fit to (.ply, or text with x y z), in the same frame as the file");
    ImGui::SameLine();
    if (Button("Load points", "", ImVec2(-1.0F, 0.0F))) {
      context_.OpenCloudFile();
    }
  }

  AnnotationTool& tool_ = editing_.annotation;
  SceneStyle& style_ = view_.style;
};

}  // namespace

PanelPtr MakeAnnotationPanel(ViewerState& s) { return std::make_unique<AnnotationPanel>(s); }

}  // namespace sqslam::viewer
