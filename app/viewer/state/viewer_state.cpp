#include "app/viewer/state/viewer_state.h"

#include <fmt/format.h>

#include <utility>

#include "app/viewer/input/input_events.h"

namespace sqslam::viewer {
namespace {

void Keep(std::filesystem::path& file, const auto& values, Messages& messages) {
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
  window.layout = memory.layout;
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
  memory.layout = window.layout;
  KeepMemory(messages);
}

void Preferences::ApplySettings(WindowState& window, SceneView& view, Messages& messages) const {
  window.theme = settings.theme;
  window.show_image = settings.show_image;
  if (view.style_name != settings.style) {
    messages.Try([&] { view.UseStyle(settings.style); });
  }
}

void Preferences::TakeSettings(const WindowState& window, const SceneView& view) {
  settings.theme = window.theme;
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

namespace {

using Action = std::function<void(ViewerState&)>;

// `keys`: as shown to the user, Ctrl before Shift.
Shortcut On(int code, const std::string& keys, const char* what, Action run) {
  return {keys, what, code, keys.find("Shift ") != keys.npos, keys.starts_with("Ctrl "), std::move(run)};
}

void PlayOrPause(ViewerState& s) {
  using What = RunControl::What;
  if (s.document.run.active) {
    s.requests.push_back(RunControl{s.document.run.paused ? What::kContinue : What::kPause});
  } else if (s.playback.playing) {
    s.playback.playing = false;
  } else {
    s.playback.Toggle(1.0, s.document.timeline);
  }
}

void NextFrame(ViewerState& s) {
  if (s.document.run.active) {
    s.requests.push_back(RunControl{RunControl::What::kStep});
  } else {
    s.playback.Step(1, s.document.timeline);
  }
}

// Returns an action on the replay that does nothing during a run.
Action OnReplay(auto run) {
  return [run](ViewerState& s) {
    if (!s.document.run.active) {
      run(s.playback, s.document.timeline);
    }
  };
}

Action LookFrom(const char* preset) {
  return [preset](ViewerState& s) { s.view.LookFrom(preset); };
}

Action Follow(CameraMode mode) {
  return [mode](ViewerState& s) { s.view.mode = s.view.mode == mode ? CameraMode::kFree : mode; };
}

Action Flip(bool& (*flag)(ViewerState&)) {
  return [flag](ViewerState& s) { flag(s) = !flag(s); };
}

void Escape(ViewerState& s) {
  if (s.window.show_open) {
    s.window.show_open = false;
  } else if (s.window.show_help) {
    s.window.show_help = false;
  } else if (s.editing.annotation.active) {
    s.editing.annotation.selected.reset();
    s.editing.annotation.chosen.clear();
  } else if (s.selection.measuring) {
    s.selection.measuring = false;
  } else {
    s.selection.selected.reset();
  }
}

std::vector<Shortcut> MakeShortcuts() {
  using State = ViewerState;
  return {
      On(key::kSpace, "Space", "play or pause", PlayOrPause),
      On('B', "B", "play backward", OnReplay([](Playback& p, const Timeline& t) { p.Toggle(-1.0, t); })),
      On(key::kRight, "Right", "next frame", NextFrame),
      On(key::kLeft, "Left", "previous frame",
         OnReplay([](Playback& p, const Timeline& t) { p.Step(-1, t); })),
      On(key::kRight, "Shift Right", "next state of the map",
         OnReplay([](Playback& p, const Timeline& t) { p.StepSnapshot(1, t); })),
      On(key::kLeft, "Shift Left", "previous state of the map",
         OnReplay([](Playback& p, const Timeline& t) { p.StepSnapshot(-1, t); })),
      On(key::kHome, "Home", "to the start",
         OnReplay([](Playback& p, const Timeline& t) { p.JumpTo(t.Begin()); })),
      On(key::kEnd, "End", "to the finished map",
         OnReplay([](Playback& p, const Timeline& t) { p.JumpTo(t.End()); })),
      On('1', "1", "view from the front", LookFrom("front")),
      On('3', "3", "view from the right", LookFrom("right")),
      On('7', "7", "view from the top", LookFrom("top")),
      On('9', "9", "isometric view", LookFrom("isometric")),
      On('0', "0", "all of the map", LookFrom("")),
      On('F', "F", "follow the camera", Follow(CameraMode::kFollow)),
      On('C', "C", "look through the camera", Follow(CameraMode::kFirstPerson)),
      On('X', "X", "cut away what is in front", [](State& s) { s.view.SwitchCut(); }),
      On('G', "G", "lines of covisible keyframes",
         Flip([](State& s) -> bool& { return s.view.style.covisibility.show; })),
      On('P', "P", "true path of the camera", Flip([](State& s) -> bool& { return s.layers.true_path; })),
      On('M', "M", "measure between two points",
         [](State& s) {
           s.selection.measuring = !s.selection.measuring;
           s.selection.measured.clear();
         }),
      On(key::kF12, "F12", "save a picture", [](State& s) { s.requests.push_back(s.window.screenshot); }),
      On('R', "R", "film the screen, stop",
         [](State& s) { s.requests.push_back(FilmRequest{!s.window.filming}); }),
      On('K', "K", "key frame of a camera path",
         [](State& s) {
           s.view.keys.Add(s.view.camera);
           s.messages.Say(fmt::format("Key frame {} of the camera path is set.", s.view.keys.keys.size()));
         }),
      On('C', "Ctrl Shift C", "copy the command of the picture",
         [](State& s) {
           if (s.document.Map() != nullptr && !s.document.run.active) {
             s.requests.push_back(CopyCommandRequest{});
           }
         }),
      On('I', "I", "show or hide the image", Flip([](State& s) -> bool& { return s.window.show_image; })),
      On('T', "T", "dark or light", [](State& s) { SwitchTheme(s.window, s.view, s.messages); }),
      On('H', "H", "this help", Flip([](State& s) -> bool& { return s.window.show_help; })),
      On('O', "Ctrl O", "open a result", Flip([](State& s) -> bool& { return s.window.show_open; })),
      On(key::kDelete, "Delete", "delete what is selected", [](State& s) { s.Editor().DeleteSelected(); }),
      On('Z', "Ctrl Z", "undo", [](State& s) { s.editing.document.Undo(); }),
      On('Y', "Ctrl Y", "redo", [](State& s) { s.editing.document.Redo(); }),
      On('S', "Ctrl S", "save edits and annotation", [](State& s) { s.Editor().SaveAll(); }),
      On(key::kEscape, "Escape", "unselect, close", Escape),
      On('Q', "Ctrl Q", "quit", [](State& s) { s.requests.push_back(QuitRequest{}); }),
  };
}

}  // namespace

const std::vector<Shortcut>& Shortcuts() {
  static const std::vector<Shortcut> kShortcuts = MakeShortcuts();
  return kShortcuts;
}

void RunShortcut(ViewerState& state, int code, bool shift, bool control) {
  const int plain = code >= key::kKeypad0 && code <= key::kKeypad9 ? '0' + code - key::kKeypad0 : code;
  for (const Shortcut& shortcut : Shortcuts()) {
    if (shortcut.code == plain && shortcut.shift == shift && shortcut.control == control) {
      shortcut.run(state);
    }
  }
}

}  // namespace sqslam::viewer
