#pragma once

#include <imgui.h>

#include "app/viewer/state/viewer_state.h"

namespace sqslam::viewer {

// Fonts of the window; owned by ImGui's atlas.
struct Fonts {
  ImFont* regular = nullptr;
  ImFont* bold = nullptr;
  ImFont* mono = nullptr;
};

// DejaVu Sans where it is installed, ImGui's own font elsewhere. `scale`: pixels for one of the layout's.
Fonts LoadFonts(double scale);

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
