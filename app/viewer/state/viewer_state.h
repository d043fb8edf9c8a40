#pragma once

#include "app/viewer/frames/timeline.h"
#include "app/viewer/state/document.h"
#include "app/viewer/state/editing.h"
#include "app/viewer/state/layers.h"
#include "app/viewer/state/preferences.h"
#include "app/viewer/state/requests.h"
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

}  // namespace sqslam::viewer
