#pragma once

#include <string>

#include "app/viewer/state/viewer_state.h"

namespace sqslam::viewer {

// The command that draws what is on the screen without a window: `sqslam render ... --output FILE`, its words
// quoted for a shell. Marks of the selection are not part of the picture. `size`: of the picture, pixels.
std::string RenderCommandLine(const ViewerState& state, cv::Size size, bool transparent,
                              const std::string& output);

// The values of a style that differ from those of another, as KEY=VALUE of --set.
std::vector<std::string> StyleChanges(const SceneStyle& style, const SceneStyle& from);

}  // namespace sqslam::viewer
