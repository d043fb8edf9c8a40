#include "app/viewer/layout.h"

#include <algorithm>

namespace sqslam::viewer {
namespace {

constexpr double kGap = 5.0;  // between parts, at scale 1

double Limited(double value, double low, double high) { return std::max(low, std::min(value, high)); }

}  // namespace

Layout LayOut(cv::Size window, double menu_height, const LayoutSettings& settings, bool has_bottom,
              bool has_top, double scale) {
  Layout layout;
  const double width = window.width;
  const double height = window.height;
  const double gap = kGap * scale;
  layout.menu = {0.0, 0.0, width, menu_height};
  const double bottom = has_bottom ? std::min(settings.bottom * scale, 0.4 * height) : 0.0;
  const double side = std::min(settings.side * scale, 0.5 * width);
  const double body_bottom = height - (has_bottom ? bottom + gap : 0.0);
  const double body = std::max(0.0, body_bottom - menu_height);
  layout.scene = {0.0, menu_height, std::max(0.0, width - side - gap), body};
  const double left = width - side;
  const double top = has_top ? std::min(settings.top * scale, 0.5 * body) : 0.0;
  layout.top = {left, menu_height, side, top};
  const double tabs = menu_height + (has_top ? top + gap : 0.0);
  layout.side = {left, tabs, side, std::max(0.0, body_bottom - tabs)};
  layout.side_line = {left - gap, menu_height, gap, body};
  if (has_bottom) {
    layout.bottom = {0.0, height - bottom, width, bottom};
    layout.bottom_line = {0.0, height - bottom - gap, width, gap};
  }
  if (has_top) {
    layout.top_line = {left, menu_height + top, side, gap};
  }
  return layout;
}

LayoutSettings MoveSide(LayoutSettings settings, double pixels, cv::Size window, double scale) {
  settings.side = Limited(settings.side - pixels / scale, 240.0, 0.5 * window.width / scale);
  return settings;
}

LayoutSettings MoveBottom(LayoutSettings settings, double pixels, cv::Size window, double scale) {
  settings.bottom = Limited(settings.bottom - pixels / scale, 96.0, 0.4 * window.height / scale);
  return settings;
}

LayoutSettings MoveTop(LayoutSettings settings, double pixels, cv::Size window, double scale) {
  settings.top = Limited(settings.top + pixels / scale, 120.0, 0.6 * window.height / scale);
  return settings;
}

}  // namespace sqslam::viewer
