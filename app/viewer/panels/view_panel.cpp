#include <fmt/format.h>
#include <imgui.h>

#include <array>

#include "app/viewer/panels/panels.h"
#include "app/viewer/widgets.h"
#include "render/view_presets.h"
#include "slam/util/data_path.h"

namespace sqslam::viewer {
namespace {

class ViewPanel : public Panel {
 public:
  Place Where() const override { return Place::kSide; }
  std::string Title() const override { return "View"; }

  void Draw(ViewerState& state) override {
    ImGui::BeginChild("view");
    DrawViews(state);
    DrawCamera(state);
    DrawLayers(state);
    DrawLook(state);
    ImGui::EndChild();
  }

 private:
  static void DrawViews(ViewerState& state) {
    Heading("View from");
    const float width = (ImGui::GetContentRegionAvail().x - 2.0F * ImGui::GetStyle().ItemSpacing.x) / 3.0F;
    int number = 0;
    for (const std::string& name : ViewPresetNames()) {
      if (number++ % 3 != 0) {
        ImGui::SameLine();
      }
      const bool is = state.view.preset == name && state.view.mode == CameraMode::kFree;
      if (is) {
        ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_Header));
      }
      if (ImGui::Button(name.c_str(), ImVec2(width, 0.0F))) {
        LookFrom(state, name);
      }
      if (is) {
        ImGui::PopStyleColor();
      }
    }
  }

  static void DrawCamera(ViewerState& state) {
    Heading("Camera");
    constexpr std::array<const char*, 3> kNames = {"free", "follow", "through"};
    constexpr std::array<const char*, 3> kTips = {"As you move it", "Behind the input camera (F)",
                                                  "Through the input camera (C)"};
    for (int i = 0; i < 3; ++i) {
      if (i > 0) {
        ImGui::SameLine();
      }
      bool on = static_cast<int>(state.view.mode) == i;
      const auto at = static_cast<std::size_t>(i);
      if (Toggle(kNames[at], &on, kTips[at])) {
        state.view.mode = static_cast<CameraMode>(i);
        if (state.view.mode == CameraMode::kFree) {
          state.view.camera.pinhole.reset();
        }
      }
    }
    ImGui::SameLine();
    if (ImGui::Button("all of the map")) {
      LookFrom(state, "");
    }
    Tip("Frames the objects and what is around them (0)");
  }

  static bool Check(const char* name, bool& on) { return ImGui::Checkbox(name, &on); }

  static void DrawLayers(ViewerState& state) {
    Heading("Layers");
    SceneStyle& style = state.view.style;
    bool changed = false;
    const float column = 0.5F * ImGui::GetContentRegionAvail().x;
    const auto pair = [&](const char* a, bool& on_a, const char* b, bool& on_b) {
      changed |= Check(a, on_a);
      ImGui::SameLine(column);
      changed |= Check(b, on_b);
    };
    pair("objects", style.objects.show, "names", style.objects.labels);
    pair("points", style.points.show, "grid", style.grid.show);
    pair("camera path", style.cameras.trajectory, "keyframes", style.cameras.keyframes);
    pair("present camera", style.cameras.current, "legend", style.text.legend);
    changed |= Check("axes and scale", style.text.scale);
    state.view.style_version += changed ? 1 : 0;
  }

  static bool Slide(const char* name, double& value, float low, float high, const char* format) {
    auto single = static_cast<float>(value);
    ImGui::SetNextItemWidth(-8.5F * ImGui::GetFontSize());
    const bool changed = ImGui::SliderFloat(name, &single, low, high, format);
    if (changed) {
      value = static_cast<double>(single);
    }
    return changed;
  }

  static void DrawLook(ViewerState& state) {
    Heading("Look");
    ImGui::SetNextItemWidth(-8.5F * ImGui::GetFontSize());
    if (ImGui::BeginCombo("style", state.view.style_name.c_str())) {
      for (const std::string& name : ConfigNames("configs/styles")) {
        if (ImGui::Selectable(name.c_str(), name == state.view.style_name)) {
          UseStyle(state, name);
        }
      }
      ImGui::EndCombo();
    }
    SceneStyle& style = state.view.style;
    bool changed = Slide("opacity", style.objects.opacity, 0.05F, 1.0F, "%.2f");
    changed |= Slide("points", style.points.size, 0.5F, 8.0F, "%.1f px");
    changed |= Slide("object points", style.points.object_size, 0.5F, 10.0F, "%.1f px");
    changed |= Slide("shadow", style.light.shadow, 0.0F, 1.0F, "%.2f");
    changed |= Slide("outlines", style.light.outline, 0.0F, 1.0F, "%.2f");
    state.view.style_version += changed ? 1 : 0;
    double angle = state.view.camera.view_angle;
    if (Slide("view angle", angle, 10.0F, 100.0F, "%.0f\u00b0") && state.view.mode == CameraMode::kFree) {
      state.view.camera.view_angle = angle;
    }
  }
};

}  // namespace

PanelPtr MakeViewPanel() { return std::make_unique<ViewPanel>(); }

}  // namespace sqslam::viewer
