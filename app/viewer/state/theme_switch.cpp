#include "app/viewer/state/theme_switch.h"

namespace sqslam::viewer {

void SwitchTheme(ViewerState& state) {
  const bool goes_along = state.view.style_name == SceneStyleOf(state.theme);
  state.theme = state.theme == Theme::kDark ? Theme::kLight : Theme::kDark;
  if (goes_along) {
    UseStyle(state, SceneStyleOf(state.theme));
  }
}

const char* SceneStyleOf(Theme theme) { return theme == Theme::kDark ? "dark" : "paper"; }

}  // namespace sqslam::viewer
