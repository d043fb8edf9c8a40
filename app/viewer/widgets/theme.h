#pragma once

#include <imgui.h>

#include "app/viewer/state/preferences.h"

namespace sqslam::viewer {

// Regular and bold (Bold() of widgets.h) DejaVu Sans where it is installed, ImGui's own font elsewhere.
// `scale`: pixels for one of the layout's.
void LoadFonts(double scale);

// Colours, paddings and roundings.
void ApplyTheme(Theme theme, double scale);

// Colours that ImGui's style has no name for.
struct Palette {
  ImU32 accent;  // what is selected, the place on the timeline
  ImU32 faint;   // lines of plots' frames
  ImU32 text;
  ImU32 dim_text;
  ImU32 good, bad;  // states; told apart by their words as well
  ImU32 plot_a, plot_b, plot_c;
  ImU32 surface;  // of cards over the scene
};
const Palette& PaletteOf(Theme theme);

}  // namespace sqslam::viewer
