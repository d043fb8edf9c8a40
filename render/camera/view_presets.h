#pragma once

#include <string>
#include <vector>

#include "render/camera/scene_framing.h"

namespace sqslam {

// Named views, each framed like the automatic one: front, right, back, left, top, isometric. The front is
// where the cameras stood on average; right is to the right of somebody who stands there. They look level,
// top straight down with the front below; isometric from 45 degrees to the right and 35.26 up, in
// perspective.
const std::vector<std::string>& ViewPresetNames();

// Throws UsageError, which lists the names, for another one. aspect: width / height; view_angle: degrees.
ViewCamera PresetView(const std::string& name, const SceneFocus& focus, double aspect,
                      double view_angle = 30.0);

}  // namespace sqslam
