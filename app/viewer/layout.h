#pragma once

#include <opencv2/core.hpp>

namespace sqslam::viewer {

// How the window is split; the user moves the lines between the parts. Lengths at scale 1.
struct LayoutSettings {
  double side = 420.0;    // width of the column on the right
  double bottom = 146.0;  // height of the timeline
  double top = 272.0;     // height of the image above the tabs
};

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

}  // namespace sqslam::viewer
