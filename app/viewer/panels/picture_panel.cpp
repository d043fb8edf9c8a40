#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <tuple>

#include "app/viewer/panels/panels.h"
#include "app/viewer/widgets/widgets.h"

namespace sqslam::viewer {
namespace {

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
    if (Toggle(on ? "Stop filming (R)" : "Film the screen (R)", &on,
               "What you see, as an .mp4 of 25 frames a second")) {
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
    if (Toggle("as here", &as_screen_, "As large as the view on the screen")) {
      as_screen_ = true;
    }
    for (const auto& [name, width, height] :
         {std::tuple("HD", 1920, 1080), {"4K", 3840, 2160}, {"3:2", 2400, 1600}}) {
      ImGui::SameLine();
      if (ImGui::Button(name)) {
        width_ = width;
        height_ = height;
        as_screen_ = false;
      }
    }
    ImGui::Checkbox("transparent background", &transparent_);
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
      if (ImGui::Selectable(fmt::format("key {}   {:.1f} s", i + 1, path.keys[i].time).c_str(), false, 0,
                            ImVec2(9.0F * ImGui::GetFontSize(), 0.0F))) {
        view_.MoveTo(path.keys[i].camera);
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

PanelPtr MakePicturePanel(ViewerState& s) { return std::make_unique<PicturePanel>(s); }

}  // namespace sqslam::viewer
