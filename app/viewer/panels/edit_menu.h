#pragma once

#include "app/viewer/state/viewer_state.h"

// Menus of editing; to be called between BeginMenu and EndMenu, or in the menu bar.
namespace sqslam::viewer {

void DrawEditMenu(ViewerState& state);     // the whole menu
void DrawRecentFiles(ViewerState& state);  // entries of the menu of files

}  // namespace sqslam::viewer
