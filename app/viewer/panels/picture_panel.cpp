#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>

#include "app/viewer/panels/panels.h"
#include "app/viewer/widgets/widgets.h"

namespace sqslam::viewer {
namespace {

// Pictures of what is on the screen, in any size.
class PicturePanel : public Panel {
 public:
  Place Where() const override { return Place::kSide; }
  std::string Title() const override { return "Picture"; }

  void Draw(ViewerState& state) override {
    if (state.Map() == nullptr) {
      ImGui::TextDisabled("No map is open.");
      return;
    }
    ImGui::BeginChild("picture");
    Heading("Size in pixels");
    const float field = 5.5F * ImGui::GetFontSize();
    if (as_screen_) {
      width_ = state.scene_size.width;
      height_ = state.scene_size.height;
    }
    ImGui::SetNextItemWidth(field);
    bool typed = ImGui::InputInt("\u00d7", &width_, 0);
    ImGui::SameLine();
    ImGui::SetNextItemWidth(field);
    typed |= ImGui::InputInt("##height", &height_, 0);
    as_screen_ = as_screen_ && !typed;
    DrawSizes();
    ImGui::Checkbox("transparent background", &transparent_);
    const cv::Size size = as_screen_ ? cv::Size() : Size();
    state.screenshot = {{}, size.width, size.height, transparent_};
    Heading("Keep it");
    if (ImGui::Button("Save picture (F12)")) {
      state.Ask(state.screenshot);
    }
    Tip("Drawn anew in that size, into the folder from which the program was started");
    ImGui::SameLine();
    // A run that goes on has no file that another program could draw.
    if (!state.run.active) {
      if (ImGui::Button("Copy command")) {
        CopyCommand(state);
      }
      Tip("The sqslam render command that draws the same picture without a window");
    }
    DrawFilm(state);
    DrawPath(state);
    ImGui::EndChild();
  }

 private:
  static void DrawFilm(ViewerState& state) {
    Heading("Video");
    bool on = state.filming;
    if (Toggle(on ? "Stop filming (R)" : "Film the screen (R)", &on,
               "What you see, as an .mp4 of 25 frames a second")) {
      state.Ask(FilmRequest{on});
    }
  }

  // Key frames for `sqslam render --camera-path`.
  static void DrawPath(ViewerState& state) {
    Heading("Camera path");
    CameraKeys& path = state.camera_keys;
    if (ImGui::Button("Add this view (K)")) {
      path.Add(state.view.camera);
    }
    Tip("The present view becomes the next key frame");
    ImGui::SameLine();
    ImGui::SetNextItemWidth(5.5F * ImGui::GetFontSize());
    auto interval = static_cast<float>(path.interval);
    if (ImGui::InputFloat("s apart", &interval, 0.0F, 0.0F, "%.1f")) {
      path.interval = std::clamp(static_cast<double>(interval), 0.1, 600.0);
    }
    for (std::size_t i = 0; i < path.keys.size(); ++i) {
      ImGui::PushID(static_cast<int>(i));
      if (ImGui::Selectable(fmt::format("key {}   {:.1f} s", i + 1, path.keys[i].time).c_str(), false, 0,
                            ImVec2(9.0F * ImGui::GetFontSize(), 0.0F))) {
        state.view.camera = path.keys[i].camera;
        state.view.mode = CameraMode::kFree;
        state.view.automatic = false;
        state.view.preset = "";
      }
      Tip("Look from there");
      ImGui::SameLine();
      if (ImGui::SmallButton("remove")) {
        path.Remove(i);
      }
      ImGui::PopID();
    }
    if (path.keys.size() >= 2) {
      ImGui::Checkbox("back to the first", &path.loop);
      ImGui::SameLine();
      if (ImGui::Button("Save path")) {
        state.Ask(SaveTextRequest{"camera-path", ".yaml", path.Yaml()});
      }
      Tip("A file for sqslam render --camera-path");
    }
  }

  cv::Size Size() const { return {std::clamp(width_, 16, 8192), std::clamp(height_, 16, 8192)}; }

  void DrawSizes() {
    struct Preset {
      const char* name;
      int width, height;
    };
    constexpr std::array<Preset, 3> kPresets = {
        {{"HD", 1920, 1080}, {"4K", 3840, 2160}, {"3:2", 2400, 1600}}};
    if (Toggle("as here", &as_screen_, "As large as the view on the screen")) {
      as_screen_ = true;
    }
    for (const Preset& preset : kPresets) {
      ImGui::SameLine();
      if (ImGui::Button(preset.name)) {
        width_ = preset.width;
        height_ = preset.height;
        as_screen_ = false;
      }
    }
  }

  int width_ = 1280;
  int height_ = 720;
  bool as_screen_ = true;
  bool transparent_ = false;
};

}  // namespace

PanelPtr MakePicturePanel() { return std::make_unique<PicturePanel>(); }

}  // namespace sqslam::viewer
