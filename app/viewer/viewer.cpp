#include "app/viewer/viewer.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>
#include <backends/imgui_impl_opengl3.h>
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "app/viewer/model/folder_list.h"
#include "slam/util/atomic_file.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;
namespace {

// Longest time for which drawing is held back while a frame is being read.
constexpr std::chrono::milliseconds kMaxHold{60};

// All panels, in the order of tabs and of overlapping windows.
std::vector<PanelPtr> AllPanels(ViewerState& s) {
  std::vector<PanelPtr> panels;
  for (const auto make : {MakeScenePanel, MakeImagePanel, MakeObjectsPanel, MakeInspectorPanel, MakeViewPanel,
                          MakeAnnotationPanel, MakePicturePanel, MakeTimelinePanel, MakeDialogs}) {
    panels.push_back(make(s));
  }
  return panels;
}

}  // namespace

UserInterface::UserInterface(double scale) {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;  // the viewer keeps its own settings
  io.LogFilename = nullptr;
  io.UserData = &labels_;
  io.ConfigWindowsMoveFromTitleBarOnly = true;
  SetUpUiKeys();
  ImGui_ImplOpenGL3_Init("#version 330 core");
  LoadFonts(scale);
}

UserInterface::~UserInterface() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui::DestroyContext();
}

Viewer::Viewer(cv::Size window, double scale) : ui_(scale), window_(window) {
  state_.window.scale = scale;
  state_.messages.Try([&] { state_.view.UseStyle(SceneStyleOf(state_.window.settings.theme)); });
  panels_ = AllPanels(state_);
  ImGui::GetIO().DisplaySize = Vec(window.width, window.height);
}

void Viewer::Open(const fs::path& path) {
  if (!session_.Runs()) {
    editing_.Forget();
  }
  session_.Open(path);
}

void Viewer::Handle(const InputEvent& event) {
  using Kind = InputEvent::Kind;
  if (event.kind == Kind::kResize) {
    ApplyToUi(event);
    window_ = {static_cast<int>(event.x), static_cast<int>(event.y)};
  } else if (event.kind == Kind::kDrop) {
    state_.requests.push_back(OpenRequest{event.text});
  } else if (event.kind == Kind::kClose) {
    state_.requests.push_back(QuitRequest{});
  } else {
    waiting_.push_back(event);
  }
}

// Passes waiting events to ImGui up to the first that would undo, or move away from, one of this frame.
void Viewer::TakeInput() {
  using Kind = InputEvent::Kind;
  std::set<int> buttons, keys;  // changed in this frame
  for (; !waiting_.empty(); waiting_.pop_front()) {
    const InputEvent& event = waiting_.front();
    const bool button = event.kind == Kind::kPress || event.kind == Kind::kRelease;
    const bool key = event.kind == Kind::kKeyDown || event.kind == Kind::kKeyUp;
    if ((button && !buttons.insert(event.code).second) || (key && !keys.insert(event.code).second) ||
        (event.kind == Kind::kMove && !buttons.empty())) {
      return;
    }
    ApplyToUi(event);
    if (event.kind == Kind::kKeyDown) {
      keys_.push_back(event);
    }
  }
}

bool Viewer::Frame(double seconds) {
  ViewerState& s = state_;
  s.window.seconds = seconds;
  GLint framebuffer = 0;  // the window's or a test's; drawing may leave another one bound
  glGetIntegerv(GL_FRAMEBUFFER_BINDING, &framebuffer);
  for (const Request& request : std::exchange(s.requests, {})) {
    s.messages.Try([&] { std::visit([this](const auto& asked) { Do(asked); }, request); });
  }
  const bool news = session_.TakeNews();
  if (editing_.Update(s.document, s.editing, s.messages)) {
    s.window.memory.Remember(s.document.file);
    s.messages.Try([&] { Save(s.window.memory); });
  }
  s.layers.mesh = s.view.style.dense_cloud.look == DenseLook::kMesh;
  layers_.Update(s.layers, s.document, s.messages);
  session_.FrameLayers();
  session_.RequestFrame(seconds);
  if (window_.width < 1 || window_.height < 1) {
    return false;  // minimised
  }
  if (applied_theme_ != s.window.settings.theme) {
    ApplyTheme(s.window.settings.theme, s.window.scale);
    applied_theme_ = s.window.settings.theme;
  }
  ImGui::GetIO().DeltaTime = static_cast<float>(std::max(seconds, 1e-4));
  TakeInput();
  ShownLabels().clear();
  ImGui_ImplOpenGL3_NewFrame();
  ImGui::NewFrame();
  RunShortcuts();
  session_.MoveCamera();
  DrawWindow(s, panels_, window_);
  const bool asked = session_.RequestFrame(0.0);
  s.selection.hovered = std::exchange(s.selection.pointed, std::nullopt);
  glBindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(framebuffer));
  if (Holds(asked, news)) {
    ImGui::EndFrame();
    return false;
  }
  ImGui::Render();
  glViewport(0, 0, window_.width, window_.height);
  const ImVec4 back = ImGui::GetStyleColorVec4(ImGuiCol_MenuBarBg);
  glClearColor(back.x, back.y, back.z, 1.0F);
  glClear(GL_COLOR_BUFFER_BIT);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  FilmFrame();
  return true;
}

// Holds back drawing until the requested frame is there, since drawing the old one would only delay it; but
// not for long, or a slow file would make the window look frozen.
bool Viewer::Holds(bool asked, bool news) {
  const auto now = std::chrono::steady_clock::now();
  const bool holds = !film_ && !news && (held_ ? session_.Reads() && now - *held_ < kMaxHold : asked);
  held_ = holds ? std::optional(held_.value_or(now)) : std::nullopt;
  return holds;
}

bool Viewer::Busy() const {
  return !Idle() || state_.playback.playing || film_ ||
         std::ranges::any_of(panels_, [](const PanelPtr& panel) { return panel->Wanted() && panel->Busy(); });
}

bool Viewer::Idle() const {
  const bool settled = std::ranges::none_of(
      panels_, [](const PanelPtr& panel) { return panel->place == Place::kScene && panel->Busy(); });
  return session_.Idle() && settled && !layers_.Busy() && state_.requests.empty() && waiting_.empty();
}

void Viewer::RunShortcuts() {
  const ImGuiIO& io = ImGui::GetIO();
  for (const InputEvent& event : std::exchange(keys_, {})) {
    if (!io.WantTextInput) {
      RunShortcut(state_, event.code, io.KeyShift, io.KeyCtrl);
    }
  }
}

std::string Viewer::Stem() const {
  return state_.document.title.empty() ? "map" : fs::path(state_.document.title).stem().string();
}

void Viewer::Film(bool on) {
  const bool done = state_.messages.Try([&] {
    if (on && !film_) {
      film_ = std::make_unique<ScreenFilm>(FreeName(Stem(), ".mp4"), state_.view.size);
    } else if (!on && film_) {
      const std::unique_ptr<ScreenFilm> ended = std::move(film_);
      ended->Finish();
      state_.messages.AddNotice(fmt::format("The video is in {}", ended->File().string()));
    }
  });
  film_ = done ? std::move(film_) : nullptr;
  state_.window.filming = film_ != nullptr;
}

// Adds the scene as last drawn to the video.
void Viewer::FilmFrame() {
  const SceneView& view = state_.view;
  if (film_ && view.size.area() > 0 && !state_.messages.Try([&] {
        film_->Add(ReadFramebuffer(window_, {view.corner, EvenSize(view.size)}), state_.window.seconds);
      })) {
    film_.reset();
    state_.window.filming = false;
  }
}

void Viewer::Do(const OpenRequest& request) {
  if (IsCloudFile(request.path) && state_.document.Map() != nullptr) {
    state_.layers.ShowCloud(request.path);
  } else if (!state_.editing.Postpone(request)) {
    Open(request.path);
  }
}

void Viewer::Do(const ScreenshotRequest& request) {
  const fs::path file = FreeName(Stem(), ".png");
  const cv::Size size = request.width > 0 ? cv::Size(request.width, request.height) : state_.view.size;
  WriteScreenshot(state_, size, request.transparent, file);
  state_.messages.AddNotice(fmt::format("{} x {} pixels are in {}", size.width, size.height, file.string()));
}

void Viewer::Do(const CopyCommandRequest&) {
  const ScreenshotRequest& wanted = state_.window.screenshot;
  const cv::Size size = wanted.width > 0 ? cv::Size(wanted.width, wanted.height) : state_.view.size;
  clipboard_ = RenderCommandLine(state_, size, wanted.transparent, "map.png");
  std::string notice = "The command that draws this picture is on the clipboard.";
  if (state_.editing.document.EditsModified()) {
    notice += " It shows the edits once they are saved (Ctrl S).";
  }
  if (state_.editing.representation != SolidKind::kSuperquadric) {
    notice += " It draws superquadrics.";
  }
  state_.messages.AddNotice(notice);
}

void Viewer::Do(const SaveTextRequest& request) {
  const fs::path file = FreeName(request.name, request.extension);
  WriteFileAtomically(file, request.text);
  state_.messages.AddNotice(fmt::format("Saved as {}", file.string()));
}

void Viewer::Do(const QuitRequest& request) {
  Film(false);
  if (!state_.editing.Postpone(request)) {
    closing_ = true;
    session_.Control({RunControl::Command::kEnd});
  }
}

}  // namespace sqslam::viewer
