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

// State of the window around the map.
struct WindowState {
  ViewerSettings settings;
  ViewerMemory memory;
  double scale = 1.0;  // window pixels per layout pixel
  bool show_help = false;
  bool show_settings = false;
  bool show_open = false;        // the browser of folders
  std::string to_front;          // title of a tab to be shown next; empty: none
  double seconds = 1.0 / 60.0;   // since the previous frame
  bool filming = false;          // the screen is being filmed
  ScreenshotRequest screenshot;  // for F12: size and background chosen last
};

// Returns the state with the settings and the memory that were kept. Adds a line for each value that is
// invalid.
WindowState KeptWindowState(std::vector<std::string>& warnings);

// The whole state of the viewer, without OpenGL and ImGui; each part has one owner. Panels change their own
// part, and ask for all else by requests.
struct ViewerState {
  Document document;
  Playback playback;
  Selection selection;
  SceneView view;
  Layers layers;
  Editing editing;
  WindowState window;
  Messages messages;
  std::vector<Request> requests;  // of panels and keys, for the next frame

  EditContext Editor() { return {document, view, selection, editing, messages}; }
};

// Returns the style of the scene that matches a theme.
const char* SceneStyleOf(Theme theme);

// Switches between dark and light. The scene follows if its style matches the theme, else it stays.
void SwitchTheme(ViewerState& state);

// A key that works wherever the mouse is, unless text is being typed.
struct Shortcut {
  std::string keys;  // as shown to the user
  std::string help;
  int code = 0;  // input_events.h
  bool shift = false;
  bool control = false;
  std::function<void(ViewerState&)> run;
};

// Returns all shortcuts in the order of the help.
const std::vector<Shortcut>& Shortcuts();

// Runs the shortcut of the key, if any.
void RunShortcut(ViewerState& state, int code, bool shift, bool control);

}  // namespace sqslam::viewer
