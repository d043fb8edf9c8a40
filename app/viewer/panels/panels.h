#pragma once

#include "app/viewer/panels/panel.h"

namespace sqslam::viewer {

PanelPtr MakeScenePanel();  // needs an OpenGL context, here and when it is destroyed
PanelPtr MakeImagePanel();  // the same
PanelPtr MakeTimelinePanel();
PanelPtr MakeObjectsPanel();
PanelPtr MakeInspectorPanel();
PanelPtr MakeViewPanel();
PanelPtr MakeAnnotationPanel();
PanelPtr MakePicturePanel();
PanelPtr MakeHelpPanel();
PanelPtr MakeNoticesPanel();
PanelPtr MakeSettingsPanel();
PanelPtr MakeUnsavedPanel();  // the question what becomes of unsaved changes

// All panels of the window, in the order in which tabs stand and windows lie over one another.
Panels AllPanels();

}  // namespace sqslam::viewer
