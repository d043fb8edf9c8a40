#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace sqslam::viewer {

enum class Theme { kDark, kLight };
constexpr auto EnumNames(Theme) { return std::array{"dark", "light"}; }

// Sizes of the parts of the window, pixels at 96 dpi; the user drags the lines between them.
struct LayoutSettings {
  double side = 420.0;    // width of the column on the right
  double bottom = 146.0;  // height of the time axis
  double top = 272.0;     // height of the image above the tabs
};

// The user's settings, kept in $XDG_CONFIG_HOME/sqslam/viewer.yaml.
struct ViewerSettings {
  std::filesystem::path kept_in;  // empty: not kept
  Theme theme = Theme::kDark;
  std::string style = "dark";  // of the scene: name of a style or FILE.yaml
  double font_size = 15.0;     // pixels at 96 dpi
  bool show_image = true;      // beside the map

  void VisitFields(auto&& visit) {
    visit("theme", theme);
    visit("style", style);
    visit("font_size", font_size, 8.0, 48.0);
    visit("show_image", show_image);
  }
};

// State that the viewer remembers, kept in $XDG_STATE_HOME/sqslam/viewer.yaml.
struct ViewerMemory {
  static constexpr std::size_t kMaxRecentFiles = 12;

  std::filesystem::path kept_in;  // empty: not kept
  int window_width = 1440;        // pixels at 96 dpi
  int window_height = 900;
  LayoutSettings layout;
  std::vector<std::string> recent_files;  // absolute, newest first

  void VisitFields(auto&& visit) {
    visit("window_width", window_width, 320, 16384);
    visit("window_height", window_height, 240, 16384);
    visit("side", layout.side, 1.0, 5000.0);
    visit("bottom", layout.bottom, 1.0, 5000.0);
    visit("top", layout.top, 1.0, 5000.0);
    visit("recent_files", recent_files);
  }

  // Moves or adds the file to the top of the list.
  void Remember(const std::filesystem::path& file);
  void ForgetMissing();  // drops files that no longer exist
};

// $XDG_CONFIG_HOME or ~/.config, and $XDG_STATE_HOME or ~/.local/state, each with /sqslam/viewer.yaml. Empty
// if there is no home directory: then nothing is kept.
std::filesystem::path SettingsFile();
std::filesystem::path MemoryFile();

// Reads settings or memory from a file. A missing file gives the defaults, and so does a value that is
// invalid, with a line in `warnings`; unknown keys are ignored.
template <typename Values>
Values Load(const std::filesystem::path& file, std::vector<std::string>& warnings);

// Writes the values to their file, in a new folder if missing. Throws InputError.
void Save(const auto& values);

}  // namespace sqslam::viewer
