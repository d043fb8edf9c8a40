#pragma once

#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/viewer/frames/live_run.h"
#include "app/viewer/frames/replay.h"
#include "app/viewer/layout.h"
#include "app/viewer/panels/panels.h"
#include "app/viewer/state/editing_session.h"
#include "app/viewer/state/layer_session.h"
#include "app/viewer/state/theme_switch.h"
#include "app/viewer/state/video_recorder.h"
#include "app/viewer/viewer.h"
#include "app/viewer/widgets/theme.h"

// For the sources of Viewer only: viewer.cpp (events and frames), viewer_document.cpp (what is open),
// viewer_parts.cpp (menu, panels), viewer_requests.cpp (what panels ask for).
namespace sqslam::viewer {

// ImGui's context with its drawing, from construction to destruction.
class UserInterface {
 public:
  UserInterface();
  ~UserInterface();
  UserInterface(const UserInterface&) = delete;
  UserInterface& operator=(const UserInterface&) = delete;
};

// How long a window that waits for what it is to show may stay as it is.
inline constexpr std::chrono::milliseconds kHoldAtMost{60};

struct Viewer::Impl {
  explicit Impl(cv::Size size, double scale) : window(size) {
    state.ui_scale = scale;
    LoadFonts(scale);
    UseStyle(state, SceneStyleOf(state.theme));
    panels = AllPanels();
    ImGui::GetIO().DisplaySize = ImVec2(static_cast<float>(size.width), static_cast<float>(size.height));
  }

  void Open(const std::filesystem::path& path);
  void Read(const std::filesystem::path& path);
  void Watch(std::unique_ptr<LiveRun> new_run, const app::RunRequest& request);
  bool TakeNews();
  void TakeRunNews();
  void FinishRun(const LiveRun::News& news);
  void Control(RunRequestChange::What what);
  void Frame(const MapSnapshotPtr& map);
  void TakeOpened(const OpenedRecording& opened);
  void ForgetLayers();
  bool RequestFrame(double seconds);
  bool Holds(bool asked, bool news);
  void MoveCamera();
  void RunShortcuts();
  void DrawPanels();
  void DrawMenu(double& height);
  void DrawSide(const Layout& layout);
  void DrawLines(const Layout& layout);
  void DrawWelcome(const Layout& layout);
  void CarryOut();
  void Save(const ScreenshotRequest& wanted);
  void SaveText(const SaveTextRequest& wanted);
  void Film(bool on);
  void FilmFrame();
  std::string Stem() const;  // of the names of files
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
  LayoutSettings& layout = state.layout;
  std::unique_ptr<LiveRun> run;
  double max_rate = 0.0;  // that the run was told last
  int exit_code = 0;
  std::unique_ptr<VideoRecorder> film;
  std::unique_ptr<Replay> replay;
  EditingSession editing;
  LayerSession layers;
  std::optional<Moment> requested;  // the last frame that was asked of the replay
  bool finished_run = false;        // the recording that is read is that of the run that was watched
  MapSnapshotPtr framed;            // the map before which the camera stands by itself
  std::optional<std::chrono::steady_clock::time_point> held;  // since when nothing was drawn
  bool closing = false;
  std::optional<std::string> clipboard;
  std::optional<Theme> applied_theme;
  std::vector<InputEvent> keys;  // pressed since the last frame
};

}  // namespace sqslam::viewer
