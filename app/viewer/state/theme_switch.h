#pragma once

#include "app/viewer/state/viewer_state.h"

namespace sqslam::viewer {

// Dark to light and back. A scene in the style that goes with the theme goes along, any other stays.
void SwitchTheme(ViewerState& state);

// The style of the scene that goes with a theme.
const char* SceneStyleOf(Theme theme);

}  // namespace sqslam::viewer
