#include "app/viewer/panels/panels.h"

namespace sqslam::viewer {

Panels AllPanels() {
  Panels panels;
  panels.push_back(MakeScenePanel());
  panels.push_back(MakeImagePanel());
  panels.push_back(MakeObjectsPanel());
  panels.push_back(MakeInspectorPanel());
  panels.push_back(MakeViewPanel());
  panels.push_back(MakeAnnotationPanel());
  panels.push_back(MakePicturePanel());
  panels.push_back(MakeTimelinePanel());
  panels.push_back(MakeHelpPanel());
  panels.push_back(MakeSettingsPanel());
  panels.push_back(MakeUnsavedPanel());
  panels.push_back(MakeNoticesPanel());
  return panels;
}

}  // namespace sqslam::viewer
