#include "app/viewer/viewer.h"

#include <GL/gl.h>
#include <backends/imgui_impl_opengl3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <set>
#include <utility>

#include "app/viewer/camera_control.h"
#include "app/viewer/edit_menu.h"
#include "app/viewer/editing_session.h"
#include "app/viewer/layout.h"
#include "app/viewer/panels/panels.h"
#include "app/viewer/replay.h"
#include "app/viewer/shortcuts.h"
#include "app/viewer/theme.h"
#include "app/viewer/theme_switch.h"
#include "app/viewer/ui_input.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;
namespace {

// ImGui's context with its drawing, from construction to destruction.
class UserInterface {
 public:
  UserInterface() {
    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;  // settings are the viewer's own
    io.LogFilename = nullptr;
    io.ConfigWindowsMoveFromTitleBarOnly = true;
    SetUpUiKeys();
    ImGui_ImplOpenGL3_Init("#version 330 core");
  }
  ~UserInterface() {
    ImGui_ImplOpenGL3_Shutdown();
    ImGui::DestroyContext();
  }
  UserInterface(const UserInterface&) = delete;
  UserInterface& operator=(const UserInterface&) = delete;
};

ImVec2 Corner(const cv::Rect2d& area) { return {static_cast<float>(area.x), static_cast<float>(area.y)}; }
ImVec2 Extent(const cv::Rect2d& area) {
  return {static_cast<float>(area.width), static_cast<float>(area.height)};
}

constexpr ImGuiWindowFlags kPart = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus |
                                   ImGuiWindowFlags_NoNav;

// Draws a part of the window; false where it has no place.
template <typename Content>
void DrawPart(const char* id, const cv::Rect2d& area, bool padded, Content&& content) {
  if (area.width < 1.0 || area.height < 1.0) {
    return;
  }
  ImGui::SetNextWindowPos(Corner(area));
  ImGui::SetNextWindowSize(Extent(area));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0.0F);
  if (!padded) {
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0.0F, 0.0F));
  }
  ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, ImVec2(1.0F, 1.0F));
  ImGui::Begin(id, nullptr, kPart | (padded ? 0 : ImGuiWindowFlags_NoScrollWithMouse));
  ImGui::PopStyleVar(padded ? 2 : 3);
  content();
  ImGui::End();
}

}  // namespace

struct Viewer::Impl {
  explicit Impl(cv::Size size, double scale) : window(size) {
    state.ui_scale = scale;
    LoadFonts(scale);
    UseStyle(state, SceneStyleOf(state.theme));
    panels = AllPanels();
    ImGui::GetIO().DisplaySize = ImVec2(static_cast<float>(size.width), static_cast<float>(size.height));
  }

  void Open(const fs::path& path);
  void Read(const fs::path& path);
  void Watch(std::unique_ptr<LiveRun> new_run, const app::RunRequest& request);
  void TakeNews();
  void TakeRunNews();
  void FinishRun(const LiveRun::News& news);
  void Control(RunRequestChange::What what);
  void Frame(const MapSnapshotPtr& map);
  void TakeOpened(const OpenedRecording& opened);
  void RequestFrame();
  void MoveCamera();
  void RunShortcuts();
  void DrawPanels();
  void DrawMenu(double& height);
  void DrawSide(const Layout& layout);
  void DrawLines(const Layout& layout);
  void DrawWelcome(const Layout& layout);
  void CarryOut();
  bool Wanted(Place place) const {
    return std::any_of(panels.begin(), panels.end(), [&](const PanelPtr& panel) {
      return panel->Where() == place && panel->Wanted(state);
    });
  }
  template <typename Draw>
  void ForEach(Place place, Draw&& draw) {
    for (const PanelPtr& panel : panels) {
      if (panel->Where() == place && panel->Wanted(state)) {
        draw(*panel);
      }
    }
  }

  UserInterface ui;  // before all that draws
  cv::Size window;
  ViewerState state;
  Panels panels;
  LayoutSettings layout;
  std::unique_ptr<LiveRun> run;
  double max_rate = 0.0;  // that the run was told last
  int exit_code = 0;
  std::unique_ptr<Replay> replay;
  EditingSession editing;
  std::optional<Moment> requested;  // the last frame that was asked of the replay
  bool finished_run = false;        // the recording that is read is that of the run that was watched
  MapSnapshotPtr framed;            // the map before which the camera stands by itself
  bool closing = false;
  std::optional<std::string> clipboard;
  std::optional<Theme> applied_theme;
  std::vector<InputEvent> keys;  // pressed since the last frame
};

void Viewer::Impl::Open(const fs::path& path) {
  if (run) {
    state.Complain("A run goes on; end it before something else is opened.");
    return;
  }
  state.shown = nullptr;
  state.playback = {};
  state.selected.reset();
  state.measurement = {};
  state.run = {};
  state.view.preset = "";
  state.document = {};
  Read(path);
}

// Begins to read a recording; what is on the screen stays until it is there.
void Viewer::Impl::Read(const fs::path& path) {
  requested.reset();
  state.document.kind = Document::Kind::kRecording;
  state.document.loading = true;
  state.document.file = path;
  state.document.title = fs::absolute(path).lexically_normal().filename().string();
  replay = std::make_unique<Replay>(path);
}

void Viewer::Impl::Watch(std::unique_ptr<LiveRun> new_run, const app::RunRequest& request) {
  run = std::move(new_run);
  state.document = {};
  state.document.kind = Document::Kind::kRun;
  state.document.file = request.output / "map.sqmap";
  state.document.title = request.output.filename().string();
  state.run.active = true;
  state.run.state = "starting";
}

// Framing, scale and colours of a growing map: taken anew only when it has become another one, so that
// nothing trembles.
void Viewer::Impl::Frame(const MapSnapshotPtr& map) {
  Document& document = state.document;
  document.last = map;
  const auto labels = [](const MapSnapshot& of) {
    std::set<std::string> names;
    for (const SnapshotObject& object : of.objects) {
      names.insert(object.label);
    }
    return names;
  };
  if (document.frame) {
    const SceneFocus focus = FindFocus(*map);
    const double growth = focus.radius / state.focus.radius;
    const bool same = growth > 0.85 && growth < 1.18 &&
                      (focus.center - state.focus.center).norm() < 0.15 * focus.radius &&
                      focus.up.dot(state.focus.up) > 0.99 && labels(*map) == labels(*document.frame);
    if (same) {
      return;
    }
  }
  document.frame = map;
}

void Viewer::Impl::Control(RunRequestChange::What what) {
  if (!run) {
    return;
  }
  switch (what) {
    case RunRequestChange::What::kPause:
      return run->Pause();
    case RunRequestChange::What::kContinue:
      return run->Continue();
    case RunRequestChange::What::kStep:
      return run->Step();
    case RunRequestChange::What::kEnd:
      return run->End();
  }
}

void Viewer::Impl::TakeRunNews() {
  if (!run) {
    return;
  }
  run->DrawPending();
  if (max_rate != state.run.max_rate) {
    max_rate = state.run.max_rate;
    run->SetMaxRate(max_rate);
  }
  LiveRun::News news = run->Poll();
  RunStatus& status = state.run;
  status.paused = news.paused;
  status.ending = news.ending;
  status.state = news.state.empty() ? status.state : news.state;
  status.frames = news.frames;
  status.total = news.total;
  Timeline& timeline = state.document.timeline;
  timeline.moments.insert(timeline.moments.end(), news.moments.begin(), news.moments.end());
  if (news.map) {
    timeline.series = run->Series();
    Frame(news.map);
  }
  if (news.frame) {
    state.shown = std::move(news.frame);
  }
  if (news.finished) {
    FinishRun(news);
  }
}

void Viewer::Impl::FinishRun(const LiveRun::News& news) {
  exit_code = news.exit_code;
  state.run = {};
  run.reset();
  if (!news.error.empty()) {
    state.Complain(news.error);
  }
  if (news.result.empty()) {
    state.document = {};
    return;
  }
  state.Say("The map is saved in " + news.result.string());
  finished_run = true;
  Read(news.result);
}

void Viewer::Impl::TakeOpened(const OpenedRecording& opened) {
  Document& document = state.document;
  document.file = opened.file;
  const fs::path folder = fs::absolute(opened.file).lexically_normal().parent_path();
  document.title =
      opened.file.filename() == "map.sqmap" ? folder.filename().string() : opened.file.filename().string();
  document.info = opened.info;
  document.stats = opened.stats;
  document.last = document.frame = opened.last;
  document.timeline = {};
  document.loading = false;
  auto shown = std::make_shared<ShownFrame>();
  shown->frame_index = opened.last->frame_index;
  shown->timestamp = opened.last->timestamp;
  shown->map = opened.last;
  shown->detections = opened.last->detections;
  shown->no_image = "It is being read.";
  state.shown = std::move(shown);
}

void Viewer::Impl::TakeNews() {
  if (!replay) {
    return;
  }
  Replay::News news = replay->Poll();
  if (news.opened) {
    TakeOpened(*news.opened);
  }
  if (news.timeline) {
    const bool first = state.document.timeline.Empty();
    state.document.timeline = std::move(*news.timeline);
    if (first) {
      state.playback.time = state.document.timeline.End();
    }
  }
  state.document.progress = news.progress;
  if (news.frame) {
    state.shown = std::move(news.frame);
  }
  if (!news.error.empty()) {
    state.Complain(news.error);
    if (state.document.loading) {
      replay.reset();
      state.document = {};
    }
  }
}

void Viewer::Impl::RequestFrame() {
  const Timeline& timeline = state.document.timeline;
  if (!replay || timeline.Empty()) {
    return;
  }
  state.playback.Advance(state.seconds, timeline);
  const Moment& moment = timeline.moments[static_cast<std::size_t>(timeline.At(state.playback.time))];
  if (!requested || requested->frame_index != moment.frame_index) {
    requested = moment;
    replay->Request(moment);
  }
}

// Where the camera goes by itself.
void Viewer::Impl::MoveCamera() {
  const MapSnapshot* map = state.Map();
  if (map == nullptr) {
    return;
  }
  if (framed != state.document.frame && state.scene_size.area() > 0) {
    const bool first = framed == nullptr || state.document.kind == Document::Kind::kRecording;
    framed = state.document.frame;
    state.focus = FindFocus(*framed);
    if (first && !(finished_run && !state.view.automatic)) {
      LookFrom(state, state.view.preset);
    }
    finished_run = false;
  }
  if (state.view.automatic && state.view.mode == CameraMode::kFree && state.run.active) {
    // A growing map is followed smoothly.
    state.view.camera =
        Between(state.view.camera, NamedView(state, state.view.preset), std::min(1.0, 4.0 * state.seconds));
  }
  if (state.view.mode == CameraMode::kFree || !map->T_map_camera) {
    return;
  }
  if (state.view.mode == CameraMode::kFollow) {
    state.view.camera = Behind(*map->T_map_camera, state.focus.up, 0.6 * state.focus.radius);
  } else {
    state.view.camera = FirstPerson(*map->T_map_camera, map->camera, state.focus.radius);
  }
}

void Viewer::Impl::RunShortcuts() {
  const ImGuiIO& io = ImGui::GetIO();
  for (const InputEvent& event : std::exchange(keys, {})) {
    if (!io.WantTextInput) {
      RunShortcut(state, event.code, io.KeyShift, io.KeyCtrl);
    }
  }
}

void Viewer::Impl::DrawMenu(double& height) {
  if (ImGui::BeginMainMenuBar()) {
    ImGui::PushFont(ImGui::GetIO().Fonts->Fonts[std::min(1, ImGui::GetIO().Fonts->Fonts.Size - 1)]);
    ImGui::TextUnformatted("sqslam");
    ImGui::PopFont();
    ImGui::Separator();
    if (ImGui::BeginMenu("File")) {
      DrawRecentFiles(state);
      if (ImGui::MenuItem("Save picture", "F12", false, state.Map() != nullptr)) {
        state.Ask(ScreenshotRequest{});
      }
      if (ImGui::MenuItem("Quit", "Ctrl Q")) {
        state.Ask(QuitRequest{});
      }
      ImGui::EndMenu();
    }
    DrawEditMenu(state);
    if (ImGui::BeginMenu("Window")) {
      ImGui::MenuItem("Image", "I", &state.show_image);
      if (ImGui::MenuItem("Light", "T", state.theme == Theme::kLight)) {
        SwitchTheme(state);
      }
      ImGui::EndMenu();
    }
    if (ImGui::BeginMenu("Help")) {
      ImGui::MenuItem("Keys and mouse", "H", &state.show_help);
      ImGui::EndMenu();
    }
    const std::string title = state.document.loading              ? state.document.title + ": loading"
                              : state.editing.document.Modified() ? state.document.title + " \u2022 not saved"
                                                                  : state.document.title;
    const float width = ImGui::CalcTextSize(title.c_str()).x;
    ImGui::SetCursorPosX(ImGui::GetWindowWidth() - width - 1.2F * ImGui::GetFontSize());
    ImGui::TextDisabled("%s", title.c_str());
    height = ImGui::GetWindowHeight();
    ImGui::EndMainMenuBar();
  }
}

void Viewer::Impl::DrawSide(const Layout& parts) {
  DrawPart("##side", parts.side, true, [&] {
    if (ImGui::BeginTabBar("tabs")) {
      ForEach(Place::kSide, [&](Panel& panel) {
        if (ImGui::BeginTabItem(panel.Title().c_str())) {
          panel.Draw(state);
          ImGui::EndTabItem();
        }
      });
      ImGui::EndTabBar();
    }
  });
}

void Viewer::Impl::DrawLines(const Layout& parts) {
  const auto line = [&](const char* id, const cv::Rect2d& area, ImGuiMouseCursor cursor, auto move) {
    DrawPart(id, area, false, [&] {
      ImGui::InvisibleButton("line", Extent(area));
      if (ImGui::IsItemHovered() || ImGui::IsItemActive()) {
        ImGui::SetMouseCursor(cursor);
        ImGui::GetWindowDrawList()->AddRectFilled(
            Corner(area),
            ImVec2(static_cast<float>(area.x + area.width), static_cast<float>(area.y + area.height)),
            ImGui::GetColorU32(ImGuiCol_SeparatorActive));
      }
      if (ImGui::IsItemActive()) {
        layout = move(ImGui::GetIO().MouseDelta);
      }
    });
  };
  const double scale = state.ui_scale;
  line("##side line", parts.side_line, ImGuiMouseCursor_ResizeEW,
       [&](ImVec2 d) { return MoveSide(layout, d.x, window, scale); });
  line("##bottom line", parts.bottom_line, ImGuiMouseCursor_ResizeNS,
       [&](ImVec2 d) { return MoveBottom(layout, d.y, window, scale); });
  line("##top line", parts.top_line, ImGuiMouseCursor_ResizeNS,
       [&](ImVec2 d) { return MoveTop(layout, d.y, window, scale); });
}

void Viewer::Impl::DrawWelcome(const Layout& parts) {
  const char* text = state.run.active         ? "The map begins when the camera has moved sideways"
                     : state.document.loading ? "Loading ..."
                                              : "Drop a result folder or a map.sqmap here";
  const ImVec2 size = ImGui::CalcTextSize(text);
  const ImVec2 middle(static_cast<float>(parts.scene.x + 0.5 * parts.scene.width) - 0.5F * size.x,
                      static_cast<float>(parts.scene.y + 0.5 * parts.scene.height) - 0.5F * size.y);
  ImGui::GetForegroundDrawList()->AddText(middle, PaletteOf(state.theme).dim_text, text);
}

void Viewer::Impl::DrawPanels() {
  double menu = 0.0;
  DrawMenu(menu);
  const Layout parts =
      LayOut(window, menu, layout, Wanted(Place::kBottom), Wanted(Place::kTop), state.ui_scale);
  DrawPart("##scene", parts.scene, false, [&] { ForEach(Place::kScene, [&](Panel& p) { p.Draw(state); }); });
  if (state.Map() == nullptr) {
    DrawWelcome(parts);
  }
  DrawPart("##top", parts.top, true, [&] { ForEach(Place::kTop, [&](Panel& p) { p.Draw(state); }); });
  DrawSide(parts);
  DrawPart("##bottom", parts.bottom, true,
           [&] { ForEach(Place::kBottom, [&](Panel& p) { p.Draw(state); }); });
  DrawLines(parts);
  ForEach(Place::kOver, [&](Panel& panel) { panel.Draw(state); });
}

void Viewer::Impl::CarryOut() {
  const Requests requests = std::exchange(state.requests, {});
  if (requests.open && !Postpone(state, {.quit = false, .open = requests.open->path})) {
    Open(requests.open->path);
  }
  if (requests.copy) {
    clipboard = requests.copy->text;
    state.Say(requests.copy->notice);
  }
  if (requests.run) {
    Control(requests.run->what);
  }
  if (requests.quit && !Postpone(state, {.quit = true, .open = {}})) {
    closing = true;
    Control(RunRequestChange::What::kEnd);
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

void Viewer::Frame(double seconds) {
  Impl& s = *impl_;
  s.state.seconds = seconds;
  s.CarryOut();
  s.TakeRunNews();
  s.TakeNews();
  s.editing.Update(s.state);
  s.RequestFrame();
  if (s.window.width < 1 || s.window.height < 1) {
    return;  // minimised
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
  s.state.hovered = std::exchange(s.state.pointed, std::nullopt);
  ImGui::Render();
  glViewport(0, 0, s.window.width, s.window.height);
  const ImVec4 back = ImGui::GetStyleColorVec4(ImGuiCol_MenuBarBg);
  glClearColor(back.x, back.y, back.z, 1.0F);
  glClear(GL_COLOR_BUFFER_BIT);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

bool Viewer::Busy() const {
  const Impl& s = *impl_;
  return !Idle() || s.state.playback.playing ||
         std::any_of(s.panels.begin(), s.panels.end(),
                     [&](const PanelPtr& panel) { return panel->Wanted(s.state) && panel->Busy(); });
}

bool Viewer::Idle() const {
  const Impl& s = *impl_;
  const bool settled = std::none_of(s.panels.begin(), s.panels.end(), [&](const PanelPtr& panel) {
    return panel->Where() == Place::kScene && panel->Busy();
  });
  return (!s.replay || s.replay->Idle()) && !s.run && settled && !s.editing.Busy() &&
         s.state.requests.Empty();
}

bool Viewer::WantsToClose() const { return impl_->closing && !impl_->run; }
int Viewer::ExitCode() const { return impl_->exit_code; }
std::optional<std::string> Viewer::TakeClipboard() { return std::exchange(impl_->clipboard, std::nullopt); }
const ViewerState& Viewer::State() const { return impl_->state; }
ViewerState& Viewer::State() { return impl_->state; }

}  // namespace sqslam::viewer
