#include "app/viewer/state/viewer_state.h"

#include <fmt/format.h>

#include <utility>

#include "app/viewer/input/input_events.h"

namespace sqslam::viewer {
namespace {

using Action = std::function<void(ViewerState&)>;

Shortcut Plain(int code, const char* keys, const char* what, Action run) {
  return {keys, what, code, false, false, std::move(run)};
}
Shortcut Shift(int code, const char* keys, const char* what, Action run) {
  return {keys, what, code, true, false, std::move(run)};
}
Shortcut Control(int code, const char* keys, const char* what, Action run) {
  return {keys, what, code, false, true, std::move(run)};
}

void PlayOrPause(ViewerState& s) {
  using What = RunControl::What;
  if (s.document.run.active) {
    s.requests.Ask(RunControl{s.document.run.paused ? What::kContinue : What::kPause});
  } else if (s.playback.playing) {
    s.playback.playing = false;
  } else {
    s.playback.Toggle(1.0, s.document.timeline);
  }
}

void NextFrame(ViewerState& s) {
  if (s.document.run.active) {
    s.requests.Ask(RunControl{RunControl::What::kStep});
  } else {
    s.playback.Step(1, s.document.timeline);
  }
}

// An action on the replay; a run that goes on has none.
template <typename Run>
Action OnReplay(Run run) {
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
  if (s.window.show_help) {
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
      Plain(key::kSpace, "Space", "play or pause", PlayOrPause),
      Plain('B', "B", "play backward", [](State& s) { s.playback.Toggle(-1.0, s.document.timeline); }),
      Plain(key::kRight, "Right", "next frame", NextFrame),
      Plain(key::kLeft, "Left", "previous frame",
            OnReplay([](Playback& p, const Timeline& t) { p.Step(-1, t); })),
      Shift(key::kRight, "Shift Right", "next state of the map",
            [](State& s) { s.playback.StepSnapshot(1, s.document.timeline); }),
      Shift(key::kLeft, "Shift Left", "previous state of the map",
            [](State& s) { s.playback.StepSnapshot(-1, s.document.timeline); }),
      Plain(key::kHome, "Home", "to the start",
            OnReplay([](Playback& p, const Timeline& t) { p.JumpTo(t.Begin()); })),
      Plain(key::kEnd, "End", "to the finished map",
            OnReplay([](Playback& p, const Timeline& t) { p.JumpTo(t.End()); })),
      Plain('1', "1", "view from the front", LookFrom("front")),
      Plain('3', "3", "view from the right", LookFrom("right")),
      Plain('7', "7", "view from the top", LookFrom("top")),
      Plain('9', "9", "isometric view", LookFrom("isometric")),
      Plain('0', "0", "all of the map", LookFrom("")),
      Plain('F', "F", "follow the camera", Follow(CameraMode::kFollow)),
      Plain('C', "C", "look through the camera", Follow(CameraMode::kFirstPerson)),
      Plain('X', "X", "cut away what is in front", [](State& s) { s.view.SwitchCut(); }),
      Plain('G', "G", "lines of covisible keyframes",
            [](State& s) {
              s.view.style.Update(
                  [](SceneStyle& style) { style.covisibility.show = !style.covisibility.show; });
            }),
      Plain('P', "P", "true path of the camera", Flip([](State& s) -> bool& { return s.layers.true_path; })),
      Plain('M', "M", "measure between two points",
            [](State& s) {
              s.selection.measuring = !s.selection.measuring;
              s.selection.measured.clear();
            }),
      Plain(key::kF12, "F12", "save a picture", [](State& s) { s.requests.Ask(s.window.screenshot); }),
      Plain('R', "R", "film the screen, stop",
            [](State& s) { s.requests.Ask(FilmRequest{!s.window.filming}); }),
      Plain('K', "K", "key frame of a camera path",
            [](State& s) {
              s.view.keys.Add(s.view.camera);
              s.messages.Say(fmt::format("Key frame {} of the camera path is set.", s.view.keys.keys.size()));
            }),
      {"Ctrl Shift C", "copy the command of the picture", 'C', true, true,
       [](State& s) {
         if (s.document.Map() != nullptr && !s.document.run.active) {
           s.requests.Ask(CopyCommandRequest{});
         }
       }},
      Plain('I', "I", "show or hide the image", Flip([](State& s) -> bool& { return s.window.show_image; })),
      Plain('T', "T", "dark or light", [](State& s) { SwitchTheme(s.window, s.view, s.messages); }),
      Plain('H', "H", "this help", Flip([](State& s) -> bool& { return s.window.show_help; })),
      Plain(key::kDelete, "Delete", "delete what is selected", [](State& s) { DeleteSelected(s.Editor()); }),
      Control('Z', "Ctrl Z", "undo", [](State& s) { s.editing.document.Undo(); }),
      Control('Y', "Ctrl Y", "redo", [](State& s) { s.editing.document.Redo(); }),
      Control('S', "Ctrl S", "save edits and annotation", [](State& s) { SaveAll(s.Editor()); }),
      Plain(key::kEscape, "Escape", "unselect, close", Escape),
      Control('Q', "Ctrl Q", "quit", [](State& s) { s.requests.Ask(QuitRequest{}); }),
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
