#include <fmt/format.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include <string>
#include <vector>

#include "app/viewer/panels/panels.h"
#include "app/viewer/widgets/widgets.h"
#include "render/camera/scene_framing.h"
#include "slam/util/data_path.h"

namespace sqslam::viewer {
namespace {

// Camera, layers, section and style of the scene.
class ViewPanel : public Panel {
 public:
  explicit ViewPanel(ViewerState& s) : Panel(Place::kSide, "View", s) {}

  void Draw() override {
    ImGui::BeginChild("view");
    DrawViews();
    DrawCamera();
    DrawLayers();
    DrawCut();
    DrawLook();
    ImGui::EndChild();
  }

 private:
  void DrawViews() {
    Heading("View from");
    const float width = (ImGui::GetContentRegionAvail().x - 2.0F * ImGui::GetStyle().ItemSpacing.x) / 3.0F;
    int number = 0;
    for (const std::string& name : ViewPresetNames()) {
      if (number++ % 3 != 0) {
        ImGui::SameLine();
      }
      const bool is = view_.preset == name && view_.mode == CameraMode::kFree;
      ImGui::PushStyleColor(ImGuiCol_Button,
                            ImGui::GetStyleColorVec4(is ? ImGuiCol_Header : ImGuiCol_Button));
      if (ImGui::Button(name.c_str(), ImVec2(width, 0.0F))) {
        view_.LookFrom(name);
      }
      ImGui::PopStyleColor();
    }
  }

  void DrawCamera() {
    Heading("Camera");
    if (const auto mode = OneOf({{"free", "As you move it"},
                                 {"follow", "Behind the input camera (F)"},
                                 {"through", "Through the input camera (C)"}},
                                static_cast<int>(view_.mode))) {
      view_.mode = static_cast<CameraMode>(*mode);
    }
    ImGui::SameLine();
    if (Button("all of the map", "Frames the objects and what is around them (0)")) {
      view_.LookFrom("");
    }
  }

  void DrawLayers() {
    Heading("Layers");
    const float column = 0.5F * ImGui::GetContentRegionAvail().x;
    const auto pair = [&](const char* a, bool& on_a, const char* b, bool& on_b) {
      ImGui::Checkbox(a, &on_a);
      ImGui::SameLine(column);
      ImGui::Checkbox(b, &on_b);
    };
    pair("objects", style_.objects.show, "names", style_.objects.labels);
    pair("points", style_.points.show, "grid", style_.grid.show);
    pair("camera path", style_.cameras.trajectory, "keyframes", style_.cameras.keyframes);
    pair("present camera", style_.cameras.current, "legend", style_.text.legend);
    const MapSnapshot* map = document_.Map();
    ImGui::BeginDisabled(map != nullptr && map->covisibility.empty());
    ImGui::Checkbox("covisibility", &style_.covisibility.show);
    ImGui::EndDisabled();
    Tip("Lines between keyframes that see the same map points (G); recordings of older programs have none");
    ImGui::SameLine(column);
    ImGui::Checkbox("axes and scale", &style_.text.scale);
    if (style_.covisibility.show) {
      ImGui::SetNextItemWidth(-8.5F * ImGui::GetFontSize());
      ImGui::SliderInt("shared points", &style_.covisibility.min_points, 15, 400, "%d",
                       ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic);
      Tip("Keyframes that see at least so many of the same map points are joined by a line");
    }
    DrawOwnLayers(column);
  }

  // Draws the controls of layers that do not come from the map.
  void DrawOwnLayers(float column) {
    ImGui::BeginDisabled(!document_.last);
    ImGui::Checkbox("true path", &layers_.true_path);
    Tip("Of the camera, as it comes with the sequence, laid over the keyframes by the best similarity (P)");
    ImGui::SameLine(column);
    ImGui::Checkbox("dense cloud", &layers_.dense_cloud);
    Tip("Of a densified map, or from a .ply file: type its name below, or drop it on the window");
    ImGui::EndDisabled();
    if (layers_.true_path && layers_.path_pairs > 0) {
      Dim(fmt::format("{:.1f} mm off, RMSE over {} keyframes", 1000.0 * layers_.path_error,
                      layers_.path_pairs));
    }
    if (layers_.dense_cloud) {
      DrawCloud();
    }
    if (layers_.reading) {
      ImGui::TextDisabled("reading ...");
    }
  }

  void DrawCloud() {
    if (cloud_file_ != layers_.cloud_file) {
      cloud_file_ = layers_.cloud_file;
      cloud_text_ = cloud_file_.string();
    }
    ImGui::SetNextItemWidth(-1.0F);
    ImGui::InputTextWithHint("##cloud", "cloud.ply", &cloud_text_);
    if (ImGui::IsItemDeactivatedAfterEdit() && !cloud_text_.empty()) {
      layers_.ShowCloud(cloud_text_);
    }
    Tip("A .ply with x y z, and red green blue if it has them; Enter reads it");
    ImGui::Checkbox("in the world's frame", &layers_.cloud_in_world);
    Tip("Of the true camera poses, in metres; otherwise it is in the map's frame");
    Slide("cloud points", style_.dense_cloud.size, 0.5, 4.0, "%.1f");
    Tip("Diameter of its points over the distance between them");
    ImGui::Checkbox("map points beside it", &style_.dense_cloud.points);
    if (layers_.cloud_file.empty()) {
      bool mesh = style_.dense_cloud.look == DenseLook::kMesh;
      ImGui::SameLine();
      if (ImGui::Checkbox("as a mesh", &mesh)) {
        style_.dense_cloud.look = mesh ? DenseLook::kMesh : DenseLook::kPoints;
      }
      Tip("The surface fused of the depth maps instead of their points; it takes some seconds to be made");
    }
  }

  void DrawCut() {
    Heading("Cut away");
    SceneStyle::Clip& clip = view_.clip;
    if (const auto axis = OneOf({{"off", "Nothing is cut"},
                                 {"x", "Along the map's x axis"},
                                 {"y", "Along the map's y axis"},
                                 {"z", "Along the map's z axis, which is up"},
                                 {"view", "Along the line of sight: what is nearer than the plane goes (X)"}},
                                static_cast<int>(clip.axis))) {
      clip.axis = static_cast<ClipAxis>(*axis);
    }
    if (clip.axis == ClipAxis::kNone) {
      return;
    }
    Slide("offset", clip.offset, -1.5, 1.5, "%.2f");
    Tip("Of the plane from the middle of the scene, of its radius");
    ImGui::Checkbox("the other side", &clip.flip);
  }

  void DrawLook() {
    Heading("Look");
    if (const auto chosen = Choice("style", view_.style_name, styles_, -8.5F)) {
      messages_.Try([&] { view_.UseStyle(styles_[*chosen]); });
    }
    if (const auto look = OneOf({{"auto", "Glass where there is a dense cloud, solid elsewhere"},
                                 {"solid", "Surfaces in light"},
                                 {"glass", "Panes that show what is in them"},
                                 {"outline", "Lines alone"}},
                                static_cast<int>(style_.objects.look))) {
      style_.objects.look = static_cast<ObjectLook>(*look);
    }
    Slide("opacity", style_.objects.opacity, 0.05, 1.0, "%.2f");
    Slide("points", style_.points.size, 0.5, 8.0, "%.1f px");
    Slide("object points", style_.points.object_size, 0.5, 10.0, "%.1f px");
    Slide("shadow", style_.light.shadow, 0.0, 1.0, "%.2f");
    Slide("outlines", style_.light.outline, 0.0, 1.0, "%.2f");
    double angle = view_.camera.view_angle;
    if (Slide("view angle", angle, 10.0, 100.0, "%.0f\u00b0") && view_.mode == CameraMode::kFree) {
      view_.camera.view_angle = angle;
    }
  }

  const std::vector<std::string> styles_ = ConfigNames("configs/styles");
  SceneStyle& style_ = view_.style;
  std::filesystem::path cloud_file_;  // from which the text was made
  std::string cloud_text_;
};

}  // namespace

PanelPtr MakeViewPanel(ViewerState& s) { return std::make_unique<ViewPanel>(s); }

}  // namespace sqslam::viewer
