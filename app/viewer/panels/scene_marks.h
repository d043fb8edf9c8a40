#pragma once

#include <imgui.h>

#include <functional>

#include "app/viewer/state/viewer_state.h"

// Marks over the scene and over the image: the selection, the input camera, measurements, and what editing
// draws there and does with the mouse.
namespace sqslam::viewer {

// Draws all marks over the scene. `origin`: its top-left corner on the screen, pixels.
void DrawSceneMarks(const EditContext& context, const WindowState& window, ImVec2 origin);

// Takes the mouse where annotating needs it; true where the scene must leave it alone then. `hovered`: the
// mouse is over the scene; to be called while the scene's button is ImGui's last item.
bool AnnotateWithMouse(const EditContext& context, const WindowState& window, ImVec2 origin, bool hovered);

// Draws the edges of the solids over the image of the present frame. `at` leads from its pixels to the
// screen.
void DrawImageMarks(const EditContext& context, const WindowState& window,
                    const std::function<ImVec2(const Eigen::Vector2d&)>& at);

}  // namespace sqslam::viewer
