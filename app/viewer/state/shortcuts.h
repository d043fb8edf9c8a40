#pragma once

#include <functional>
#include <string>
#include <vector>

#include "app/viewer/state/viewer_state.h"

namespace sqslam::viewer {

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
