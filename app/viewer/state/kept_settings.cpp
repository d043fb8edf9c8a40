#include "app/viewer/state/kept_settings.h"

#include <utility>

#include "app/viewer/state/edit_actions.h"

namespace sqslam::viewer {

KeptSettings::KeptSettings(bool keep) : keep_(keep) {
  if (!keep) {
    return;
  }
  auto settings = LoadSettings(SettingsFile());
  auto memory = LoadMemory(MemoryFile());
  settings_ = settings.values;
  memory_ = std::move(memory.values);
  memory_.ForgetMissing();
  warnings_ = std::move(settings.warnings);
  warnings_.insert(warnings_.end(), memory.warnings.begin(), memory.warnings.end());
}

cv::Size KeptSettings::WindowSize() const { return {memory_.window_width, memory_.window_height}; }

double KeptSettings::TextScale() const { return settings_.font_size / ViewerSettings().font_size; }

void KeptSettings::Give(ViewerState& state) const {
  if (!keep_) {
    return;
  }
  state.editing.settings_file = SettingsFile();
  state.editing.memory_file = MemoryFile();
  state.editing.settings = settings_;
  state.editing.memory = memory_;
  const auto kept = [](double value, double& length) { length = value > 0.0 ? value : length; };
  kept(memory_.side, state.layout.side);
  kept(memory_.bottom, state.layout.bottom);
  kept(memory_.top, state.layout.top);
  ApplySettings(state);
  for (const std::string& warning : warnings_) {
    state.Complain(warning);
  }
}

void KeptSettings::Take(ViewerState& state, cv::Size window) {
  if (!keep_) {
    return;
  }
  Editing& editing = state.editing;
  editing.settings.theme = state.theme == Theme::kLight ? "light" : "dark";
  editing.settings.style = state.view.style_name;
  editing.settings.show_image = state.show_image;
  KeepSettings(state);
  if (window.area() > 0) {
    editing.memory.window_width = window.width;
    editing.memory.window_height = window.height;
  }
  editing.memory.side = state.layout.side;
  editing.memory.bottom = state.layout.bottom;
  editing.memory.top = state.layout.top;
  KeepMemory(state);
}

}  // namespace sqslam::viewer
