#pragma once

#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "app/viewer/model/viewer_settings.h"
#include "app/viewer/state/editing.h"
#include "app/viewer/state/layers.h"
#include "app/viewer/state/scene_view.h"

namespace sqslam::viewer {

// The window around the map.
struct WindowState {
  Theme theme = Theme::kDark;
  double scale = 1.0;  // pixels for one of the layout's
  LayoutSettings layout;
  bool show_image = true;
  bool show_help = false;
  bool show_settings = false;
  bool show_open = false;        // the browser of folders
  std::string to_front;          // title of a tab that is to be shown; empty: none
  double seconds = 1.0 / 60.0;   // since the last frame of the window
  bool filming = false;          // what is on the screen goes into a video
  ScreenshotRequest screenshot;  // what F12 asks for: size and background that were chosen last
};

// Settings and memory that the program keeps from one start to the next.
struct Preferences {
  ViewerSettings settings;
  ViewerMemory memory;
  std::filesystem::path settings_file;  // empty: nothing is kept
  std::filesystem::path memory_file;
  std::vector<std::string> warnings;  // about what could not be read

  static Preferences Read();

  double TextScale() const { return settings.font_size / ViewerSettings().font_size; }

  // Write them to the disk; failures are said once.
  void KeepSettings(Messages& messages);
  void KeepMemory(Messages& messages);

  // Before the first frame, and after the last, where the window has that size at scale 1.
  void Give(WindowState& window, SceneView& view, Messages& messages);
  void Take(const WindowState& window, const SceneView& view, cv::Size size, Messages& messages);

  // The settings into what they are about and back.
  void ApplySettings(WindowState& window, SceneView& view, Messages& messages) const;
  void TakeSettings(const WindowState& window, const SceneView& view);
};

// The style of the scene that goes with a theme.
const char* SceneStyleOf(Theme theme);

// Dark to light and back. A scene in the style that goes with the theme goes along, any other stays.
void SwitchTheme(WindowState& window, SceneView& view, Messages& messages);

// All that the viewer knows, each part with an owner of its own: no OpenGL, no ImGui. Panels get the parts
// that they show and ask for the rest by requests.
struct ViewerState {
  Document document;
  Playback playback;
  Selection selection;
  SceneView view;
  Layers layers;
  Editing editing;
  Preferences preferences;
  WindowState window;
  Messages messages;
  Requests requests;

  EditContext Editor() { return {document, view, selection, editing, messages}; }
};

// A key that does something wherever the mouse is, while no text is being typed.
struct Shortcut {
  std::string keys;  // as people write them
  std::string what;
  int code = 0;  // input_events.h
  bool shift = false;
  bool control = false;
  std::function<void(ViewerState&)> run;
};

// All of them, in the order of the help.
const std::vector<Shortcut>& Shortcuts();

// Does what belongs to the key, if anything.
void RunShortcut(ViewerState& state, int code, bool shift, bool control);

}  // namespace sqslam::viewer
