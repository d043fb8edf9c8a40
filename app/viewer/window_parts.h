#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "app/viewer/panels/panels.h"

namespace sqslam::viewer {

// The parts, pixels of the window; empty where they don't fit.
struct Layout {
  cv::Rect2d menu, scene, top, side, bottom;
  cv::Rect2d side_line, bottom_line, top_line;  // that the mouse takes hold of
};

// `scale`: pixels for one of the settings'. Parts that are not wanted leave their place to the others; small
// windows keep the scene.
Layout LayOut(cv::Size window, double menu_height, const LayoutSettings& settings, bool has_bottom,
              bool has_top, double scale);

// After one of the lines was moved by so many pixels; kept within what makes sense for the window.
LayoutSettings MoveSide(LayoutSettings settings, double pixels, cv::Size window, double scale);
LayoutSettings MoveBottom(LayoutSettings settings, double pixels, cv::Size window, double scale);
LayoutSettings MoveTop(LayoutSettings settings, double pixels, cv::Size window, double scale);

// Draws the whole window into ImGui's frame: the menu, the panels in their places, the lines between them.
void DrawWindow(ViewerState& state, const std::vector<PanelPtr>& panels, cv::Size size);

}  // namespace sqslam::viewer
