#include "app/viewer/state/shortcuts.h"

#include <fmt/format.h>

#include <cmath>

#include "app/viewer/input/keys.h"
#include "app/viewer/state/edit_actions.h"
#include "app/viewer/state/theme_switch.h"

namespace sqslam::viewer {
namespace {

Shortcut ViewKey(int code, const char* keys, const char* what, const char* preset) {
  return {keys, what, code, false, false, [preset](ViewerState& state) { LookFrom(state, preset); }};
}

void PlayOrPause(ViewerState& state) {
  using What = RunRequestChange::What;
  if (state.run.active) {
    state.Ask(RunRequestChange{state.run.paused ? What::kContinue : What::kPause});
    return;
  }
  if (!state.playback.playing) {
    state.playback.speed = std::abs(state.playback.speed);
  }
  state.playback.Toggle(state.document.timeline);
}

void PlayBackward(ViewerState& state) {
  const bool stop = state.playback.playing && state.playback.speed < 0.0;
  state.playback.playing = stop;
  state.playback.speed = -std::abs(state.playback.speed);
  state.playback.Toggle(state.document.timeline);
}

void Step(ViewerState& state, int count) {
  if (state.run.active) {
    if (count > 0) {
      state.Ask(RunRequestChange{RunRequestChange::What::kStep});
    }
    return;
  }
  state.playback.Step(count, state.document.timeline);
}

void Jump(ViewerState& state, double time) {
  if (!state.run.active) {
    state.playback.playing = false;
    state.playback.time = time;
  }
}

void Follow(ViewerState& state, CameraMode mode) {
  state.view.mode = state.view.mode == mode ? CameraMode::kFree : mode;
}

void Escape(ViewerState& state) {
  if (state.show_help) {
    state.show_help = false;
  } else if (state.editing.annotation.active) {
    state.editing.annotation.selected.reset();
    state.editing.annotation.chosen.clear();
  } else if (state.measurement.active) {
    state.measurement = {};
  } else {
    state.selected.reset();
  }
}

std::vector<Shortcut> MakeShortcuts() {
  const auto time = [](auto of) {
    return [of](ViewerState& state) { Jump(state, of(state.document.timeline)); };
  };
  return {
      {"Space", "play or pause", key::kSpace, false, false, PlayOrPause},
      {"B", "play backward", 'B', false, false, PlayBackward},
      {"Right", "next frame", key::kRight, false, false, [](ViewerState& s) { Step(s, 1); }},
      {"Left", "previous frame", key::kLeft, false, false, [](ViewerState& s) { Step(s, -1); }},
      {"Shift Right", "next state of the map", key::kRight, true, false,
       [](ViewerState& s) { s.playback.StepSnapshot(1, s.document.timeline); }},
      {"Shift Left", "previous state of the map", key::kLeft, true, false,
       [](ViewerState& s) { s.playback.StepSnapshot(-1, s.document.timeline); }},
      {"Home", "to the start", key::kHome, false, false, time([](const Timeline& t) { return t.Begin(); })},
      {"End", "to the finished map", key::kEnd, false, false,
       time([](const Timeline& t) { return t.End(); })},
      ViewKey('1', "1", "view from the front", "front"),
      ViewKey('3', "3", "view from the right", "right"),
      ViewKey('7', "7", "view from the top", "top"),
      ViewKey('9', "9", "isometric view", "isometric"),
      ViewKey('0', "0", "all of the map", ""),
      {"F", "follow the camera", 'F', false, false, [](ViewerState& s) { Follow(s, CameraMode::kFollow); }},
      {"C", "look through the camera", 'C', false, false,
       [](ViewerState& s) { Follow(s, CameraMode::kFirstPerson); }},
      {"X", "cut away what is in front", 'X', false, false, SwitchCut},
      {"G", "lines of covisible keyframes", 'G', false, false,
       [](ViewerState& s) {
         s.view.style.covisibility.show = !s.view.style.covisibility.show;
         ++s.view.style_version;
       }},
      {"P", "true path of the camera", 'P', false, false,
       [](ViewerState& s) { s.layers.true_path = !s.layers.true_path; }},
      {"M", "measure between two points", 'M', false, false,
       [](ViewerState& s) {
         s.measurement = {!s.measurement.active, {}};
       }},
      {"F12", "save a picture", key::kF12, false, false, [](ViewerState& s) { s.Ask(s.screenshot); }},
      {"R", "film the screen, stop", 'R', false, false,
       [](ViewerState& s) { s.Ask(FilmRequest{!s.filming}); }},
      {"K", "key frame of a camera path", 'K', false, false,
       [](ViewerState& s) {
         s.camera_keys.Add(s.view.camera);
         s.Say(fmt::format("Key frame {} of the camera path is set.", s.camera_keys.keys.size()));
       }},
      {"Ctrl Shift C", "copy the command of the picture", 'C', true, true,
       [](ViewerState& s) {
         if (s.Map() != nullptr && !s.run.active) {
           CopyCommand(s);
         }
       }},
      {"I", "show or hide the image", 'I', false, false,
       [](ViewerState& s) { s.show_image = !s.show_image; }},
      {"T", "dark or light", 'T', false, false, SwitchTheme},
      {"H", "this help", 'H', false, false, [](ViewerState& s) { s.show_help = !s.show_help; }},
      {"Delete", "delete what is selected", key::kDelete, false, false, DeleteSelected},
      {"Ctrl Z", "undo", 'Z', false, true, Undo},
      {"Ctrl Y", "redo", 'Y', false, true, Redo},
      {"Ctrl S", "save edits and annotation", 'S', false, true, SaveAll},
      {"Escape", "unselect, close", key::kEscape, false, false, Escape},
      {"Ctrl Q", "quit", 'Q', false, true, [](ViewerState& s) { s.Ask(QuitRequest{}); }},
  };
}

}  // namespace

const std::vector<Shortcut>& Shortcuts() {
  static const std::vector<Shortcut> kShortcuts = MakeShortcuts();
  return kShortcuts;
}

bool RunShortcut(ViewerState& state, int code, bool shift, bool control) {
  const int plain = code >= key::kKeypad0 && code <= key::kKeypad9 ? '0' + code - key::kKeypad0 : code;
  for (const Shortcut& shortcut : Shortcuts()) {
    if (shortcut.code == plain && shortcut.shift == shift && shortcut.control == control) {
      shortcut.run(state);
      return true;
    }
  }
  return false;
}

}  // namespace sqslam::viewer
