#include "app/viewer/state/preferences.h"

#include <utility>

namespace sqslam::viewer {
namespace {

template <typename Values>
void Keep(std::filesystem::path& file, const Values& values, Messages& messages) {
  if (!messages.Try([&] { Save(file, values); })) {
    file.clear();
  }
}

template <typename Values>
Values ReadKept(const std::filesystem::path& file, std::vector<std::string>& warnings) {
  auto loaded = Load<Values>(file);
  warnings.insert(warnings.end(), loaded.warnings.begin(), loaded.warnings.end());
  return std::move(loaded.values);
}

}  // namespace

Preferences Preferences::Read() {
  Preferences read;
  read.settings_file = SettingsFile();
  read.memory_file = MemoryFile();
  read.settings = ReadKept<ViewerSettings>(read.settings_file, read.warnings);
  read.memory = ReadKept<ViewerMemory>(read.memory_file, read.warnings);
  read.memory.ForgetMissing();
  return read;
}

void Preferences::KeepSettings(Messages& messages) { Keep(settings_file, settings, messages); }
void Preferences::KeepMemory(Messages& messages) { Keep(memory_file, memory, messages); }

void Preferences::Give(WindowState& window, SceneView& view, Messages& messages) {
  const auto kept = [](double value, double& length) { length = value > 0.0 ? value : length; };
  kept(memory.side, window.layout.side);
  kept(memory.bottom, window.layout.bottom);
  kept(memory.top, window.layout.top);
  ApplySettings(window, view, messages);
  for (const std::string& warning : std::exchange(warnings, {})) {
    messages.Complain(warning);
  }
}

void Preferences::Take(const WindowState& window, const SceneView& view, cv::Size size, Messages& messages) {
  TakeSettings(window, view);
  KeepSettings(messages);
  if (size.area() > 0) {
    memory.window_width = size.width;
    memory.window_height = size.height;
  }
  memory.side = window.layout.side;
  memory.bottom = window.layout.bottom;
  memory.top = window.layout.top;
  KeepMemory(messages);
}

void Preferences::ApplySettings(WindowState& window, SceneView& view, Messages& messages) const {
  window.theme = settings.theme == "light" ? Theme::kLight : Theme::kDark;
  window.show_image = settings.show_image;
  if (view.style_name != settings.style) {
    messages.Try([&] { view.UseStyle(settings.style); });
  }
}

void Preferences::TakeSettings(const WindowState& window, const SceneView& view) {
  settings.theme = window.theme == Theme::kLight ? "light" : "dark";
  settings.style = view.style_name;
  settings.show_image = window.show_image;
}

const char* SceneStyleOf(Theme theme) { return theme == Theme::kDark ? "dark" : "paper"; }

void SwitchTheme(WindowState& window, SceneView& view, Messages& messages) {
  const bool goes_along = view.style_name == SceneStyleOf(window.theme);
  window.theme = window.theme == Theme::kDark ? Theme::kLight : Theme::kDark;
  if (goes_along) {
    messages.Try([&] { view.UseStyle(SceneStyleOf(window.theme)); });
  }
}

}  // namespace sqslam::viewer
