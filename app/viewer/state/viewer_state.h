#pragma once

#include <functional>
#include <string>
#include <vector>

#include "app/viewer/frames/timeline.h"
#include "app/viewer/state/document.h"
#include "app/viewer/state/editing.h"
#include "app/viewer/state/exchange.h"
#include "app/viewer/state/layers.h"
#include "app/viewer/state/preferences.h"
#include "app/viewer/state/scene_view.h"

namespace sqslam::viewer {

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
