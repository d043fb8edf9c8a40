#include "app/viewer/state/viewer_state.h"

#include <fmt/format.h>

#include "app/viewer/input/input_events.h"

namespace sqslam::viewer {

WindowState KeptWindowState(std::vector<std::string>& warnings) {
  WindowState window;
  window.settings = Load<ViewerSettings>(SettingsFile(), warnings);
  window.memory = Load<ViewerMemory>(MemoryFile(), warnings);
  window.memory.ForgetMissing();
  return window;
}

const char* SceneStyleOf(Theme theme) { return theme == Theme::kDark ? "dark" : "paper"; }

void SwitchTheme(ViewerState& state) {
  Theme& theme = state.window.settings.theme;
  const bool style_follows = state.view.style_name == SceneStyleOf(theme);
  theme = theme == Theme::kDark ? Theme::kLight : Theme::kDark;
  if (style_follows) {
    state.messages.Try([&] { state.view.UseStyle(SceneStyleOf(theme)); });
  }
}

namespace {

using Action = std::function<void(ViewerState&)>;

// `keys`: as shown to the user, Ctrl before Shift.
Shortcut On(int code, const std::string& keys, const char* help, Action run) {
  return {keys, help, code, keys.find("Shift ") != keys.npos, keys.starts_with("Ctrl "), std::move(run)};
}

void PlayOrPause(ViewerState& s) {
  using Command = RunControl::Command;
  if (s.document.run.active) {
    s.requests.push_back(RunControl{s.document.run.paused ? Command::kContinue : Command::kPause});
  } else if (s.playback.playing) {
    s.playback.playing = false;
  } else {
    s.playback.Toggle(1.0, s.document.timeline);
  }
}

void NextFrame(ViewerState& s) {
  if (s.document.run.active) {
    s.requests.push_back(RunControl{RunControl::Command::kStep});
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
  if (s.editing.postponed) {
    s.editing.postponed.reset();
  } else if (s.window.show_settings) {
    s.window.show_settings = false;
  } else if (s.window.show_open) {
    s.window.show_open = false;
  } else if (s.window.show_help) {
    s.window.show_help = false;
  } else if (s.messages.CloseErrors()) {
    return;
  } else if (s.editing.annotation.active) {
    s.editing.annotation.selected.reset();
    s.editing.annotation.chosen.clear();
  } else if (s.selection.measuring) {
    s.selection.SetMeasuring(false);
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
         [](State& s) { s.selection.SetMeasuring(!s.selection.measuring); }),
      On(key::kF12, "F12", "save a picture", [](State& s) { s.requests.push_back(s.window.screenshot); }),
      On('R', "R", "film the screen, stop",
         [](State& s) { s.requests.push_back(FilmRequest{!s.window.filming}); }),
      On('K', "K", "key frame of a camera path",
         [](State& s) {
           s.view.keys.Add(s.view.camera);
           s.messages.AddNotice(
               fmt::format("Key frame {} of the camera path is set.", s.view.keys.keys.size()));
         }),
      On('C', "Ctrl Shift C", "copy the command of the picture",
         [](State& s) {
           if (s.document.Map() != nullptr && !s.document.run.active) {
             s.requests.push_back(CopyCommandRequest{});
           }
         }),
      On('I', "I", "show or hide the image",
         Flip([](State& s) -> bool& { return s.window.settings.show_image; })),
      On('T', "T", "dark or light", SwitchTheme),
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
