#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace sqslam::viewer {

enum class Theme { kDark, kLight };
constexpr auto EnumNames(Theme) { return std::array{"dark", "light"}; }

// Lengths of the parts of the window, pixels at 96 dpi; the user moves the lines between them.
struct LayoutSettings {
  double side = 420.0;    // width of the column on the right
  double bottom = 146.0;  // height of the time axis
  double top = 272.0;     // height of the image above the tabs
};

// The choices of the viewer's user, kept in $XDG_CONFIG_HOME/sqslam/viewer.yaml.
struct ViewerSettings {
  Theme theme = Theme::kDark;
  std::string style = "dark";  // of the scene: a style's name or FILE.yaml
  double font_size = 15.0;     // height of the letters, pixels at 96 dpi
  bool show_image = true;      // beside the map

  void VisitFields(auto&& visit) {
    visit("theme", theme);
    visit("style", style);
    visit("font_size", font_size, 8.0, 48.0);
    visit("show_image", show_image);
  }
};

// Values that the viewer remembers by itself, kept in $XDG_STATE_HOME/sqslam/viewer.yaml.
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

  // To the top of the list, once.
  void Remember(const std::filesystem::path& file);
  void ForgetMissing();  // drops files that are not there any more
};

// The values read, and one line for each value that could not be used (the default stands for it then).
template <typename Values>
struct Loaded {
  Values values;
  std::vector<std::string> warnings;
};

// $XDG_CONFIG_HOME or ~/.config, and $XDG_STATE_HOME or ~/.local/state, each with /sqslam/viewer.yaml. Empty
// where there is no home either: then nothing is kept.
std::filesystem::path SettingsFile();
std::filesystem::path MemoryFile();

// Read and write such values (ViewerSettings, ViewerMemory). A missing file or an empty path gives the
// defaults; keys of other versions are passed over; reading never throws. Writing makes the folder where it
// is missing, does nothing for an empty path, and throws InputError where the file cannot be written.
template <typename Values>
Loaded<Values> Load(const std::filesystem::path& file);
void Save(const std::filesystem::path& file, const auto& values);

}  // namespace sqslam::viewer
