#include "app/viewer/viewer.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <utility>

#include "app/viewer/input/ui_input.h"
#include "app/viewer/state/shortcuts.h"
#include "app/viewer/viewer_impl.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;

UserInterface::UserInterface() {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;  // settings are the viewer's own
  io.LogFilename = nullptr;
  io.ConfigWindowsMoveFromTitleBarOnly = true;
  SetUpUiKeys();
  ImGui_ImplOpenGL3_Init("#version 330 core");
}

UserInterface::~UserInterface() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui::DestroyContext();
}

void Viewer::Impl::RunShortcuts() {
  const ImGuiIO& io = ImGui::GetIO();
  for (const InputEvent& event : std::exchange(keys, {})) {
    if (!io.WantTextInput) {
      RunShortcut(state, event.code, io.KeyShift, io.KeyCtrl);
    }
  }
}

Viewer::Viewer(cv::Size window, double ui_scale) : impl_(std::make_unique<Impl>(window, ui_scale)) {}
Viewer::~Viewer() = default;

void Viewer::Open(const fs::path& path) { impl_->Open(path); }

void Viewer::Watch(std::unique_ptr<LiveRun> run, const app::RunRequest& request) {
  impl_->Watch(std::move(run), request);
}

void Viewer::Handle(const InputEvent& event) {
  Impl& s = *impl_;
  using Kind = InputEvent::Kind;
  ApplyToUi(event);
  switch (event.kind) {
    case Kind::kResize:
      s.window = {static_cast<int>(event.x), static_cast<int>(event.y)};
      break;
    case Kind::kKeyDown:
      s.keys.push_back(event);
      break;
    case Kind::kDrop:
      s.state.Ask(OpenRequest{event.text});
      break;
    case Kind::kClose:
      s.state.Ask(QuitRequest{});
      break;
    default:
      break;
  }
}

bool Viewer::Frame(double seconds) {
  Impl& s = *impl_;
  s.state.seconds = seconds;
  GLint framebuffer = 0;  // the window's, or that of a test; pictures and scenes may leave another one
  glGetIntegerv(GL_FRAMEBUFFER_BINDING, &framebuffer);
  s.CarryOut();
  s.TakeRunNews();
  const bool news = s.TakeNews();
  s.editing.Update(s.state);
  s.layers.Update(s.state);
  s.RequestFrame(seconds);
  if (s.window.width < 1 || s.window.height < 1) {
    return false;  // minimised
  }
  if (s.applied_theme != s.state.theme) {
    ApplyTheme(s.state.theme, s.state.ui_scale);
    s.applied_theme = s.state.theme;
  }
  ImGui::GetIO().DeltaTime = static_cast<float>(std::max(seconds, 1e-4));
  ImGui_ImplOpenGL3_NewFrame();
  ImGui::NewFrame();
  s.RunShortcuts();
  s.MoveCamera();
  s.DrawPanels();
  const bool asked = s.RequestFrame(0.0);
  s.state.hovered = std::exchange(s.state.pointed, std::nullopt);
  glBindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(framebuffer));
  if (s.Holds(asked, news)) {
    ImGui::EndFrame();
    return false;
  }
  ImGui::Render();
  glViewport(0, 0, s.window.width, s.window.height);
  const ImVec4 back = ImGui::GetStyleColorVec4(ImGuiCol_MenuBarBg);
  glClearColor(back.x, back.y, back.z, 1.0F);
  glClear(GL_COLOR_BUFFER_BIT);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  s.FilmFrame();
  return true;
}

bool Viewer::Busy() const {
  const Impl& s = *impl_;
  return !Idle() || s.state.playback.playing || s.film ||
         std::any_of(s.panels.begin(), s.panels.end(),
                     [&](const PanelPtr& panel) { return panel->Wanted(s.state) && panel->Busy(); });
}

bool Viewer::Idle() const {
  const Impl& s = *impl_;
  const bool settled = std::none_of(s.panels.begin(), s.panels.end(), [&](const PanelPtr& panel) {
    return panel->Where() == Place::kScene && panel->Busy();
  });
  return (!s.replay || s.replay->Idle()) && !s.run && settled && !s.editing.Busy() && !s.layers.Busy() &&
         s.state.requests.Empty();
}

bool Viewer::OnlyReads() const {
  const Impl& s = *impl_;
  const bool still = std::none_of(s.panels.begin(), s.panels.end(), [&](const PanelPtr& panel) {
    return panel->Wanted(s.state) && panel->Busy();
  });
  const bool patient = !s.held || std::chrono::steady_clock::now() - *s.held < kHoldAtMost;
  return patient && s.replay && !s.replay->Idle() && !s.replay->HasNews() && still && !s.run && !s.film &&
         !s.state.playback.playing && s.state.requests.Empty();
}

bool Viewer::WantsToClose() const { return impl_->closing && !impl_->run; }
int Viewer::ExitCode() const { return impl_->exit_code; }
std::optional<std::string> Viewer::TakeClipboard() { return std::exchange(impl_->clipboard, std::nullopt); }
const ViewerState& Viewer::State() const { return impl_->state; }
ViewerState& Viewer::State() { return impl_->state; }

}  // namespace sqslam::viewer
