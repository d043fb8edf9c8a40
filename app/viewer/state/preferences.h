#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "app/viewer/model/viewer_settings.h"
#include "app/viewer/state/exchange.h"
#include "app/viewer/state/scene_view.h"

namespace sqslam::viewer {

enum class Theme { kDark, kLight };

// Lengths of the parts of the window; the user moves the lines between the parts. Lengths at scale 1.
struct LayoutSettings {
  double side = 420.0;    // width of the column on the right
  double bottom = 146.0;  // height of the timeline
  double top = 272.0;     // height of the image above the tabs
};

// The window around the map.
struct WindowState {
  Theme theme = Theme::kDark;
  double scale = 1.0;  // pixels for one of the layout's
  LayoutSettings layout;
  bool show_image = true;
  bool show_help = false;
  bool show_settings = false;
  std::string to_front;          // title of a tab that is to be shown; empty: none
  double seconds = 1.0 / 60.0;   // since the last frame of the window
  bool filming = false;          // what is on the screen goes into a video
  ScreenshotRequest screenshot;  // what F12 asks for: size and background that were chosen last
};

// Settings and memory that the program keeps from one start to the next.
struct Preferences {
  ViewerSettings settings;
  ViewerMemory memory;
  std::filesystem::path settings_file;  // empty: nothing is kept
  std::filesystem::path memory_file;
  std::vector<std::string> warnings;  // about what could not be read

  static Preferences Read();

  double TextScale() const { return settings.font_size / ViewerSettings().font_size; }

  // Write them to the disk; failures are said once.
  void KeepSettings(Messages& messages);
  void KeepMemory(Messages& messages);

  // Before the first frame, and after the last, where the window has that size at scale 1.
  void Give(WindowState& window, SceneView& view, Messages& messages);
  void Take(const WindowState& window, const SceneView& view, cv::Size size, Messages& messages);

  // The settings into what they are about and back.
  void ApplySettings(WindowState& window, SceneView& view, Messages& messages) const;
  void TakeSettings(const WindowState& window, const SceneView& view);
};

// The style of the scene that goes with a theme.
const char* SceneStyleOf(Theme theme);

// Dark to light and back. A scene in the style that goes with the theme goes along, any other stays.
void SwitchTheme(WindowState& window, SceneView& view, Messages& messages);

}  // namespace sqslam::viewer
