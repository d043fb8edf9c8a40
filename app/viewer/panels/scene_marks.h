#pragma once

#include <imgui.h>

#include <Eigen/Core>
#include <functional>

#include "app/viewer/state/viewer_state.h"

// What editing draws over the scene and over the image, and what it does with the mouse there.
namespace sqslam::viewer {

// `origin`: of the scene on the screen. Points of the selected object, solids, their handles, the lasso.
void DrawSceneMarks(const ViewerState& state, ImVec2 origin);

// Takes the mouse where annotating needs it; true where the scene must leave it alone then. `hovered`: the
// mouse is over the scene; to be called while the scene's button is ImGui's last item.
bool AnnotateWithMouse(ViewerState& state, ImVec2 origin, bool hovered);

// Edges of the solids over the image of the present frame. `at` leads from its pixels to the screen.
void DrawImageMarks(const ViewerState& state, const std::function<ImVec2(double, double)>& at);

}  // namespace sqslam::viewer
