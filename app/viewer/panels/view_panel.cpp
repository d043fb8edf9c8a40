#include <fmt/format.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include <array>
#include <filesystem>
#include <string>

#include "app/viewer/panels/panels.h"
#include "app/viewer/widgets/widgets.h"
#include "render/camera/view_presets.h"
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
    DrawCut(state);
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

  void DrawLayers(ViewerState& state) {
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
    ImGui::BeginDisabled(state.Map() != nullptr && state.Map()->covisibility.empty());
    changed |= Check("covisibility", style.covisibility.show);
    ImGui::EndDisabled();
    Tip("Lines between keyframes that see the same map points (G); recordings of older programs have none");
    ImGui::SameLine(column);
    changed |= Check("axes and scale", style.text.scale);
    state.view.style_version += changed ? 1 : 0;
    DrawCovisibility(state);
    DrawOwnLayers(state, column);
  }

  static void DrawCovisibility(ViewerState& state) {
    SceneStyle::Covisibility& lines = state.view.style.covisibility;
    if (!lines.show) {
      return;
    }
    ImGui::SetNextItemWidth(-8.5F * ImGui::GetFontSize());
    if (ImGui::SliderInt("shared points", &lines.min_points, 15, 400, "%d",
                         ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic)) {
      ++state.view.style_version;
    }
    Tip("Keyframes that see at least so many of the same map points are joined by a line");
  }

  // What does not come from the map.
  void DrawOwnLayers(ViewerState& state, float column) {
    Layers& layers = state.layers;
    ImGui::BeginDisabled(!state.document.last);
    Check("true path", layers.true_path);
    Tip("Of the camera, as it comes with the sequence, laid over the keyframes by the best similarity (P)");
    ImGui::SameLine(column);
    Check("dense cloud", layers.dense_cloud);
    Tip("From a .ply file: type its name below, or drop it on the window");
    ImGui::EndDisabled();
    if (layers.true_path && layers.path_pairs > 0) {
      ImGui::TextDisabled("%s", fmt::format("{:.1f} mm off, RMSE over {} keyframes",
                                            1000.0 * layers.path_error, layers.path_pairs)
                                    .c_str());
    }
    if (layers.dense_cloud) {
      DrawCloud(state);
    }
    if (layers.reading) {
      ImGui::TextDisabled("reading ...");
    }
  }

  void DrawCloud(ViewerState& state) {
    Layers& layers = state.layers;
    if (cloud_file_ != layers.cloud_file) {
      cloud_file_ = layers.cloud_file;
      cloud_text_ = cloud_file_.string();
    }
    ImGui::SetNextItemWidth(-1.0F);
    ImGui::InputTextWithHint("##cloud", "cloud.ply", &cloud_text_);
    if (ImGui::IsItemDeactivatedAfterEdit() && !cloud_text_.empty()) {
      ShowCloud(state, cloud_text_);
    }
    Tip("A .ply with x y z, and red green blue if it has them; Enter reads it");
    Check("in the world's frame", layers.cloud_in_world);
    Tip("Of the true camera poses, in metres; otherwise it is in the map's frame");
    if (Slide("cloud points", state.view.style.dense_cloud.size, 0.5F, 6.0F, "%.1f px")) {
      ++state.view.style_version;
    }
  }

  static void DrawCut(ViewerState& state) {
    Heading("Cut away");
    SceneStyle::Clip& clip = state.view.style.clip;
    constexpr std::array<const char*, 5> kAxes = {"none", "x", "y", "z", "view"};
    constexpr std::array<const char*, 5> kTips = {
        "Nothing is cut", "Along the map's x axis", "Along the map's y axis",
        "Along the map's z axis, which is up",
        "Along the line of sight: what is nearer than the plane goes (X)"};
    for (std::size_t i = 0; i < kAxes.size(); ++i) {
      if (i > 0) {
        ImGui::SameLine();
      }
      bool on = clip.axis == kAxes[i];
      if (Toggle(i == 0 ? "off" : kAxes[i], &on, kTips[i])) {
        clip.axis = kAxes[i];
      }
    }
    if (clip.axis == "none") {
      return;
    }
    Slide("offset", clip.offset, -1.5F, 1.5F, "%.2f");
    Tip("Of the plane from the middle of the scene, of its radius");
    Check("the other side", clip.flip);
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

  std::filesystem::path cloud_file_;  // that the text was made from
  std::string cloud_text_;
};

}  // namespace

PanelPtr MakeViewPanel() { return std::make_unique<ViewPanel>(); }

}  // namespace sqslam::viewer
