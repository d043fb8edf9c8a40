#pragma once

#include <string>
#include <vector>

namespace sqslam::viewer {

// Key codes, equal to those of GLFW.
namespace key {
inline constexpr int kSpace = 32, kEscape = 256, kEnter = 257, kTab = 258, kBackspace = 259;
inline constexpr int kInsert = 260, kDelete = 261, kRight = 262, kLeft = 263, kDown = 264, kUp = 265;
inline constexpr int kPageUp = 266, kPageDown = 267, kHome = 268, kEnd = 269, kF1 = 290, kF12 = 301;
inline constexpr int kKeypad0 = 320, kKeypad9 = 329, kKeypadEnter = 335;
inline constexpr int kLeftShift = 340, kLeftControl = 341, kLeftAlt = 342;
inline constexpr int kRightShift = 344, kRightControl = 345, kRightAlt = 346;
}  // namespace key

// Names of keys: "Space", "F12", "A", "7", "Left"; empty for a key without a name, -1 for an unknown name.
std::string KeyName(int code);
int KeyCode(const std::string& name);

// An event from keyboard, mouse or window system. The viewer acts on nothing else, so that events can be
// recorded and played again.
struct InputEvent {
  enum class Kind {
    kMove,     // mouse: x, y in pixels from the top-left corner
    kPress,    // mouse button `code`: 0 left, 1 right, 2 middle
    kRelease,  // likewise
    kWheel,    // x, y in notches
    kKeyDown,  // `code` as above
    kKeyUp,    // likewise
    kText,     // `text`: as typed, UTF-8
    kResize,   // x, y: pixels; 0 0 while minimised
    kFocus,    // `code`: 1 gained, 0 lost
    kDrop,     // `text`: path of a file dropped on the window
    kClose,    // the window is closed
  };
  Kind kind = Kind::kMove;
  double x = 0.0;
  double y = 0.0;
  int code = 0;
  std::string text = {};

  bool operator==(const InputEvent&) const = default;
};

// One line of a script of events: an event, or an action between events.
struct ScriptLine {
  enum class Kind {
    kEvent,
    kFrames,  // let `count` frames of the window pass
    // Wait for `text`: "idle" (nothing is loading or moving), "map" (a map is there), "end" (the run has
    // ended), "frame" (frame `count` of a run is shown).
    kWait,
    kPicture,  // write the whole window to the file `text`, a PNG
    kCommand,  // write the command of the picture on the screen to the file `text`
    kExpect,   // `text`: "KEY VALUE" that must be true now, or the program fails
    kRepeat,   // repeat the script until `count` seconds after it began
    kPoint,    // move the mouse to event.x, event.y from the label `text`, once the window shows it
  };
  Kind kind = Kind::kEvent;
  InputEvent event = {};
  int count = 0;
  std::string text = {};
  int line = 0;  // line number in the file, from 1
};

// Read scripts, one event per line; `#` begins a comment. Commands:
//
//   move X Y, wheel X Y, press or release left, right or middle, click TEXT, point X Y TEXT
//   key, keydown or keyup KEY, text TEXT, resize WIDTH HEIGHT, focus 0 or 1, drop FILE, close
//   frames N, repeat SECONDS, wait idle, map, end or frame N
//   picture FILE.png, command FILE, expect KEY VALUE
//
// Example:
//
//   resize 1280 720
//   wait idle
//   click View
//   move 400 300
//   press left
//   release left
//   expect selected 3
//   key Space
//   picture /tmp/window.png
//   close
//
// "key NAME" presses and releases. "point DX DY TEXT" moves the mouse to that many pixels from a label in the
// window, and "click TEXT" clicks on it: a tab, a menu, a button, a checkbox or a row by its name; "cup*" is
// any label that begins with "cup". Throw UsageError with file, line and what was expected.
std::vector<ScriptLine> ReadScript(const std::string& path);
std::vector<ScriptLine> ParseScript(const std::string& text, const std::string& source);

// Returns the event as a line of a script; empty for keys without a name.
std::string FormatEvent(const InputEvent& event);

// Registers the keys that ImGui uses; once per context.
void SetUpUiKeys();

// Passes an event to ImGui, which ignores drop and close.
void ApplyToUi(const InputEvent& event);

bool IsKeyDown(int code);  // according to ImGui

}  // namespace sqslam::viewer
