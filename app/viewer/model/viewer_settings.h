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
  static constexpr std::size_t kMostRecent = 12;

  int window_width = 1440;  // pixels at 96 dpi
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

// The values read, and one line per value that could not be used and has its default.
template <typename Values>
struct Loaded {
  Values values;
  std::vector<std::string> warnings;
};

// $XDG_CONFIG_HOME or ~/.config, and $XDG_STATE_HOME or ~/.local/state, each with /sqslam/viewer.yaml. Empty
// if there is no home directory: then nothing is kept.
std::filesystem::path SettingsFile();
std::filesystem::path MemoryFile();

// Read and write such values (ViewerSettings, ViewerMemory). A missing file or an empty path gives the
// defaults; unknown keys are ignored; reading never throws. Writing creates the folder if missing, does
// nothing for an empty path, and throws InputError if the file cannot be written.
template <typename Values>
Loaded<Values> Load(const std::filesystem::path& file);
void Save(const std::filesystem::path& file, const auto& values);

}  // namespace sqslam::viewer
