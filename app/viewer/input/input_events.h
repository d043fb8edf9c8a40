#pragma once

#include <string>
#include <vector>

namespace sqslam::viewer {

// Keys by number. The numbers are GLFW's, so that no table is needed in the window.
namespace key {
inline constexpr int kSpace = 32, kEscape = 256, kEnter = 257, kTab = 258, kBackspace = 259;
inline constexpr int kInsert = 260, kDelete = 261, kRight = 262, kLeft = 263, kDown = 264, kUp = 265;
inline constexpr int kPageUp = 266, kPageDown = 267, kHome = 268, kEnd = 269, kF1 = 290, kF12 = 301;
inline constexpr int kKeypad0 = 320, kKeypad9 = 329, kKeypadEnter = 335;
inline constexpr int kLeftShift = 340, kLeftControl = 341, kLeftAlt = 342;
inline constexpr int kRightShift = 344, kRightControl = 345, kRightAlt = 346;
}  // namespace key

// Names of keys: "Space", "F12", "A", "7", "Left"; empty for a key without one, -1 for a name without a key.
std::string KeyName(int code);
int KeyCode(const std::string& name);

// One thing that keyboard, mouse or window system tell the viewer; all that it acts on passes through these,
// so that they can be written down and played again.
struct InputEvent {
  enum class Kind {
    kMove,     // of the mouse: x, y in pixels from the top-left corner
    kPress,    // mouse button `code`: 0 left, 1 right, 2 middle
    kRelease,  // the same
    kWheel,    // x, y in notches
    kKeyDown,  // `code` as above
    kKeyUp,    // the same
    kText,     // `text`: what was typed, UTF-8
    kResize,   // x, y: pixels; 0 0 while minimised
    kFocus,    // code: 1 won, 0 lost
    kDrop,     // `text`: a file that was dropped on the window
    kClose,    // of the window
  };
  Kind kind = Kind::kMove;
  double x = 0.0;
  double y = 0.0;
  int code = 0;
  std::string text = {};

  bool operator==(const InputEvent&) const = default;
};

// One line of a script of events: an event, or what is to be done between them.
struct ScriptLine {
  enum class Kind {
    kEvent,
    kFrames,  // let `count` frames of the window pass
    // Until `text`: "idle" nothing is loading or moving, "map" a map is there, "end" the run ended, "frame"
    // that of a run, `count`, is shown.
    kWait,
    kPicture,  // write the whole window to the file `text`
    kCommand,  // write the command of the picture on the screen to the file `text`
    kExpect,   // `text`: "KEY VALUE" that must be true now, or the program fails
    kRepeat,   // from the first line on, until `count` seconds have gone by since the script began
  };
  Kind kind = Kind::kEvent;
  InputEvent event = {};
  int count = 0;
  std::string text = {};
  int line = 0;  // of the file, from 1
};

// One line of text for each; `#` begins a comment. Example:
//
//   resize 1280 720
//   wait idle
//   move 400 300
//   press left
//   release left
//   expect selected 3
//   key Space
//   picture /tmp/window.png
//   close
//
// "key NAME" is down and up. Throws UsageError that names file, line and what was expected.
std::vector<ScriptLine> ReadScript(const std::string& path);
std::vector<ScriptLine> ParseScript(const std::string& text, const std::string& source);

std::string FormatEvent(const InputEvent& event);  // as one line of a script, without its end

// Tells ImGui of the keys by which it works; once for its context.
void SetUpUiKeys();

// Hands an event on to ImGui; what is none of its (drop, close) is passed over.
void ApplyToUi(const InputEvent& event);

}  // namespace sqslam::viewer
