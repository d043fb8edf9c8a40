#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <tuple>
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
      bool on = view_.preset == name && view_.mode == CameraMode::kFree;
      if (Toggle(name.c_str(), on, "", width)) {
        view_.LookFrom(name);
      }
    }
  }

  void DrawCamera() {
    Heading("Camera");
    OneOf({{"free", "As you move it"},
           {"follow", "Behind the input camera (F)"},
           {"through", "Through the input camera (C)"}},
          view_.mode);
    ImGui::SameLine();
    if (Button("all of the map", "Frames the objects and their surroundings (0)")) {
      view_.LookFrom("");
    }
  }

  void DrawLayers() {
    Heading("Layers");
    const float column = 0.5F * ImGui::GetContentRegionAvail().x;
    const auto pair = [&](const char* a, bool& on_a, const char* b, bool& on_b) {
      Checkbox(a, on_a);
      ImGui::SameLine(column);
      Checkbox(b, on_b);
    };
    pair("objects", style_.objects.show, "names", style_.objects.labels);
    pair("points", style_.points.show, "grid", style_.grid.show);
    pair("camera path", style_.cameras.trajectory, "keyframes", style_.cameras.keyframes);
    pair("present camera", style_.cameras.current, "legend", style_.text.legend);
    const MapSnapshot* map = document_.Map();
    ImGui::BeginDisabled(map != nullptr && map->covisibility.empty());
    Checkbox("covisibility", style_.covisibility.show,
             "Lines between keyframes that see the same map points (G)");
    ImGui::EndDisabled();
    ImGui::SameLine(column);
    Checkbox("axes and scale", style_.text.scale);
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
    Checkbox("true path", layers_.true_path,
             "Of the camera, from the sequence's ground truth, aligned to the keyframes by a similarity (P)");
    ImGui::SameLine(column);
    Checkbox("dense cloud", layers_.dense_cloud,
             "Of a densified map, or from a .ply file: type its name below, or drop it on the window");
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
    Checkbox("in the world's frame", layers_.cloud_in_world,
             "Of the true camera poses, in metres; otherwise it is in the map's frame");
    Slide("cloud points", style_.dense_cloud.size, 0.5, 4.0, "%.1f");
    Tip("Diameter of its points over the distance between them");
    Checkbox("map points beside it", style_.dense_cloud.points);
    if (layers_.cloud_file.empty()) {
      bool mesh = style_.dense_cloud.look == DenseLook::kMesh;
      ImGui::SameLine();
      Checkbox("as a mesh", mesh,
               "The surface fused of the depth maps instead of their points; takes seconds");
      style_.dense_cloud.look = mesh ? DenseLook::kMesh : DenseLook::kPoints;
    }
  }

  void DrawCut() {
    Heading("Cut away");
    SceneStyle::Clip& clip = view_.clip;
    OneOf({{"off", "Nothing is cut"},
           {"x", "Along the map's x axis"},
           {"y", "Along the map's y axis"},
           {"z", "Along the map's z axis, which is up"},
           {"view", "Along the line of sight: hides all that is nearer than the plane (X)"}},
          clip.axis);
    if (clip.axis == ClipAxis::kNone) {
      return;
    }
    Slide("offset", clip.offset, -1.5, 1.5, "%.2f");
    Tip("Of the plane from the middle of the scene, of its radius");
    Checkbox("the other side", clip.flip);
  }

  void DrawLook() {
    Heading("Look");
    std::string style = view_.style_name;
    if (Choice("style", style, styles_, -8.5F)) {
      messages_.Try([&] { view_.UseStyle(style); });
    }
    OneOf({{"auto", "Glass where there is a dense cloud, solid elsewhere; parts where they are known"},
           {"solid", "Lit surfaces"},
           {"glass", "Transparent surfaces"},
           {"outline", "Lines alone"},
           {"parts", "Lit surfaces of the parts where they are known"}},
          style_.objects.look);
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

// Pictures and videos of the screen, and camera paths for `sqslam render`.
class PicturePanel : public Panel {
 public:
  explicit PicturePanel(ViewerState& s) : Panel(Place::kSide, "Picture", s) {}

  void Draw() override {
    if (document_.Map() == nullptr) {
      ImGui::TextDisabled("No map is open.");
      return;
    }
    ImGui::BeginChild("picture");
    DrawSize();
    Heading("Keep it");
    if (Button("Save picture (F12)",
               "Drawn anew in that size, into the folder from which the program was started")) {
      requests_.push_back(window_.screenshot);
    }
    ImGui::SameLine();
    // A run in progress has no file that another program could draw.
    if (!document_.run.active &&
        Button("Copy command", "The sqslam render command that draws the same picture without a window")) {
      requests_.push_back(CopyCommandRequest{});
    }
    Heading("Video");
    bool on = window_.filming;
    if (Toggle(on ? "Stop filming (R)" : "Film the screen (R)", on,
               "The view on the screen, as an .mp4 of 25 frames a second")) {
      requests_.push_back(FilmRequest{on});
    }
    DrawPath();
    ImGui::EndChild();
  }

 private:
  void DrawSize() {
    Heading("Size in pixels");
    const float field = 5.5F * ImGui::GetFontSize();
    if (as_screen_) {
      width_ = view_.size.width;
      height_ = view_.size.height;
    }
    ImGui::SetNextItemWidth(field);
    bool typed = ImGui::InputInt("\u00d7", &width_, 0);
    ImGui::SameLine();
    ImGui::SetNextItemWidth(field);
    typed |= ImGui::InputInt("##height", &height_, 0);
    as_screen_ = as_screen_ && !typed;
    if (Toggle("as here", as_screen_, "As large as the view on the screen")) {
      as_screen_ = true;
    }
    for (const auto& [name, width, height] :
         {std::tuple("HD", 1920, 1080), {"4K", 3840, 2160}, {"3:2", 2400, 1600}}) {
      ImGui::SameLine();
      if (Button(name)) {
        width_ = width;
        height_ = height;
        as_screen_ = false;
      }
    }
    Checkbox("transparent background", transparent_);
    window_.screenshot = {as_screen_ ? 0 : std::clamp(width_, 16, 8192),
                          as_screen_ ? 0 : std::clamp(height_, 16, 8192), transparent_};
  }

  // Key frames for `sqslam render --camera-path`.
  void DrawPath() {
    Heading("Camera path");
    CameraKeys& path = view_.keys;
    if (Button("Add this view (K)", "The present view becomes the next key frame")) {
      path.Add(view_.camera);
    }
    ImGui::SameLine();
    ImGui::SetNextItemWidth(5.5F * ImGui::GetFontSize());
    auto interval = static_cast<float>(path.interval);
    if (ImGui::InputFloat("s apart", &interval, 0.0F, 0.0F, "%.1f")) {
      path.interval = std::clamp(static_cast<double>(interval), 0.1, 600.0);
    }
    for (std::size_t i = 0; i < path.keys.size(); ++i) {
      ImGui::PushID(static_cast<int>(i));
      if (Selectable(fmt::format("key {}   {:.1f} s", i + 1, path.keys[i].time), false, 0,
                     9.0F * ImGui::GetFontSize())) {
        view_.MoveTo(path.keys[i].camera);
      }
      Tip("Look from there");
      ImGui::SameLine();
      if (SmallButton("remove")) {
        path.Remove(i);
      }
      ImGui::PopID();
    }
    if (path.keys.size() >= 2) {
      Checkbox("back to the first", path.loop);
      ImGui::SameLine();
      if (Button("Save path", "A file for sqslam render --camera-path")) {
        requests_.push_back(SaveTextRequest{"camera-path", ".yaml", path.Yaml()});
      }
    }
  }

  int width_ = 1280;
  int height_ = 720;
  bool as_screen_ = true;
  bool transparent_ = false;
};

}  // namespace

PanelPtr MakeViewPanel(ViewerState& s) { return std::make_unique<ViewPanel>(s); }
PanelPtr MakePicturePanel(ViewerState& s) { return std::make_unique<PicturePanel>(s); }

}  // namespace sqslam::viewer
